"""The demo world: four ray-cast workspaces with small objects, exact masks, poses and a map.

Reading order: shapes -> textures -> furniture, objects -> rooms -> renderer -> sensor -> world.
"""
