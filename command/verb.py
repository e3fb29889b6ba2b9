"""A verb of the command line."""

from .inputs import files_in

ONE_LINE = "Writes one JSON line per input, with notices, or the error. The exit code is 1 if any input failed."


class Verb:
    """A command for files. A new one is made for each command line, and may keep what its files share.

    A subclass has methods `run`, and `add_options` for its options.
    """

    name = help = description = ""  # on the command line, help in one line, and in full
    inputs = "files"
    outputs = ()  # endings of its output files, the first one by default in folders; empty for no output
    reads = ()  # options with other input files, which are never overwritten

    def add_options(self, parser):
        """Add options beside inputs and outputs."""

    def check(self, parser, arguments):
        """Refuse incompatible options, by `parser.error`."""

    def expand(self, path, arguments) -> list:
        """Return the files that an input stands for: those with points in a folder, or itself."""
        return files_in(path) if path.is_dir() else [path]

    def beside(self, output, arguments) -> list:
        """Return the paths of further files that are written beside an output."""
        return []

    def run(self, path, arguments, output) -> dict:
        """Process one file, write the output unless it is None, and return what to print."""
        raise NotImplementedError
