"""Steps that several families share, and the record of what they found."""
