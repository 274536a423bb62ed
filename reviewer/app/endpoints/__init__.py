"""HTTP endpoints and desk messages: what is asked, checked and answered."""
