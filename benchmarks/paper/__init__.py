"""The evaluation of the paper, figure by figure, with this project and its peers side by side."""
