"""The figures of the paper, of the peers and of this project, measured."""
