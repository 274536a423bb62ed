"""The paper's pipeline over the store: align -> detect -> search -> integrate."""
