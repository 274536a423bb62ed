"""What a person does to a pair, in one step: draw a mask and stand for it."""

from reviewer.editing.commit import change_state, commit_mask
from reviewer.store.reviews import annotator_id


def draw(store, pair_id, name, edit, state="submitted"):
    """Commit an edit as that person and set the state; reopens what the person has finished."""
    person = annotator_id(store, name)
    change_state(store, pair_id, person, "in_progress", None)
    number = commit_mask(store, pair_id, person, edit)
    if state != "in_progress":
        change_state(store, pair_id, person, state, number)
    return number


def heard(socket):
    """Return a desk's next message, but for those that say who is here."""
    while (message := socket.receive_json())["type"] == "here":
        pass
    return message
