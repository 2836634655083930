"""The subproblems into which closed-form inverses fall, one file each."""
