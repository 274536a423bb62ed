    height INTEGER NOT NULL CHECK (height > 0),  -- rows of the mask, pixels
    width INTEGER NOT NULL CHECK (width > 0),  -- columns of the mask, pixels
    rle TEXT NOT NULL,  -- COCO compressed run-lengths, column-major
    area INTEGER NOT NULL CHECK (area BETWEEN 0 AND height * width),  -- True pixels
    box_x INTEGER NOT NULL,  -- left column of the tight box, 0 when empty
    box_y INTEGER NOT NULL,  -- top row of the tight box, 0 when empty
    box_width INTEGER NOT NULL,  -- width of the tight box, 0 when empty
    box_height INTEGER NOT NULL,  -- height of the tight box, 0 when empty
