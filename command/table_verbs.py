"""Verbs that cut and measure along lines, whose outputs are tables."""

from types import SimpleNamespace

from . import clouds, profiles, sections, uncached
from .cloud_verb import SurfaceVerb, floaters
from .inputs import check_beside
from .measures import check_numbers
from .results import number_text
from .rows import TABLES, write_rows, write_text
from .settings import LAPLACIAN, chosen
from .svg import profile_picture
from .units import NO_UNITS


class CutOptions:
    """The options of a verb that cuts, for what else is written; beside those of `sections.add_options`."""

    def check(self, parser, arguments):
        """Refuse curves without an output beside which they are written."""
        check_beside(parser, arguments, "curves")

    def beside(self, output, arguments):
        """Return the path of the corners of the curves, if these are wanted."""
        return [sections.corners_path(output)] if arguments.curves else []


class PathOptions:
    """The options of a verb that measures along a path."""

    def add_options(self, parser):
        """Add both ends of the path, and the picture."""
        profiles.add_options(parser)
        super().add_options(parser)

    def check(self, parser, arguments):
        """Refuse a picture without an output beside which it is written."""
        check_beside(parser, arguments, "svg")

    def beside(self, output, arguments):
        """Return the path of the picture, if it is wanted."""
        return [profiles.picture_path(output)] if arguments.svg else []


class Section(CutOptions, SurfaceVerb):
    """The verb `section`."""

    name = "section"
    help = "cut the surface by a plane: curves, with their length and the area that they enclose"
    operator = "cross_section"

    @property
    def outputs(self):
        """Endings of files."""
        return (*TABLES, *clouds.kinds())

    def add_options(self, parser):
        named = "; or the name of an object of the input, whose local XY plane cuts" if clouds.kinds() else ""
        parser.add_argument(
            "--plane",
            type=clouds.place_or_object,
            metavar="X,Y,Z",
            help=f"position of the plane in the coordinates of the file, as --plane=X,Y,Z where X is below zero{named}."
            " Without it, the middle of the points",
        )
        sections.add_options(parser)
        super().add_options(parser)

    def check(self, parser, arguments):
        if arguments.normal is not None and isinstance(arguments.plane, str):
            parser.error("--normal goes with a position, not with an object, whose plane has one")
        super().check(parser, arguments)

    def work(self, path, given, arguments, output, progress):
        cloud, name = clouds.Cloud(path, given, floaters(arguments)), path.stem
        laplacian = self.build(cloud, chosen(LAPLACIAN.values(), arguments), progress).laplacian
        guessed, position = [], sections.middle(cloud.points)
        normal = sections.UP if arguments.normal is None else arguments.normal
        if arguments.plane is None:
            guessed = [sections.through_middle(name)]
        elif isinstance(arguments.plane, str):
            position, normal = cloud.owner.plane(arguments.plane)
            position = position - cloud.place
        else:
            position = arguments.plane - cloud.place
        found = sections.cut(laplacian, position, normal, name, progress)
        if output is not None:
            if clouds.kind_of(output) is not None:
                given.owner.add_curves([(curve.points + cloud.place, curve.closed) for curve in found.curves])
            else:
                write_rows(output, sections.curve_records(found))
            for corners in self.beside(output, arguments):
                sections.write_corners(corners, found.curves, cloud.place)
        line = sections.section_line(found, name, number_text, number_text)
        figures = {"points": len(cloud.points), "done": line, **sections.figures(found)}
        return figures, [*laplacian.notices, *guessed, *found.notices]


class Profile(PathOptions, SurfaceVerb):
    """The verb `profile`."""

    name = "profile"
    help = "measure the height or a column along the shortest path between two positions, as a table"
    settings = tuple(profiles.PROFILE.values())

    @property
    def outputs(self):
        """Endings of files."""
        return (".csv", *clouds.kinds())

    def work(self, path, given, arguments, output, progress):
        cloud, name = clouds.Cloud(path, given, floaters(arguments)), path.stem
        own, values = SimpleNamespace(**chosen(self.settings, arguments)), None
        if own.source:
            values = cloud.numbers(own.source, "--source")
            check_numbers(values, own.source, str(path))
            profiles.check_varying(values.dtype.kind == "f", own.source, str(path))
        ends = profiles.nearest_ends(cloud.points + cloud.place, [arguments.path_from, arguments.path_to])
        laplacian = self.build(cloud, chosen(LAPLACIAN.values(), arguments), progress).laplacian
        corners = profiles.path_between(laplacian, ends.rows, uncached, progress)
        found = profiles.measured(laplacian, corners, values, own, cloud.place, cloud.place)
        if output is not None:
            table = profiles.table(found.columns, own.source)
            if clouds.kind_of(output) is not None:
                given.owner.add_profile(found.distance, found.values, table)
            else:
                write_text(output, table)
            for picture in self.beside(output, arguments):
                write_text(picture, profile_picture(table, NO_UNITS))
        line = profiles.profile_line(found, own, name, number_text)
        figures = {"points": len(cloud.points), "done": line, **profiles.figures(found), **ends.figures}
        return figures, [*laplacian.notices, *profiles.missing(found, name)]
