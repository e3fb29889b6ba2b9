"""Call every verb of the wheel, in the environment that runs this, on coral.ply in the present folder.

Prints a line for each: its name, the exit code, and "done" or what is wrong.
"""

import contextlib
import io
import json
from pathlib import Path

import meshfree_laplacian as mf
import numpy as np
from meshfree_laplacian.command.line import run
from meshfree_laplacian.command.verbs import make_verbs

COUNT = 500  # points


def call(*arguments):
    """Run a command line; return the exit code, and the record of its only input."""
    told = io.StringIO()
    with contextlib.redirect_stdout(told), contextlib.redirect_stderr(io.StringIO()):
        code = run([*arguments], make_verbs(), "meshfree")
    [line] = told.getvalue().splitlines()
    return code, json.loads(line)


def option(name, place):
    """Return an option for a position."""
    return f"--{name}={','.join(map(repr, place.tolist()))}"


def prepare():
    """Write what the verbs need beside the cloud, and return its highest and its lowest point."""
    call("thin-out", "coral.ply", "--by", "number", "--count", str(COUNT), "--out", "thin.ply")
    points = mf.files.read_points(Path("thin.ply")).points
    count, height = len(points), points[:, 2]
    top, low = points[height.argmax()], points[height.argmin()]
    np.save("curve.npy", [top, points[0], low])
    groups = {"Low": height < np.quantile(height, 0.1), "High": height > np.quantile(height, 0.9)}
    groups["Fixed"] = height < np.median(height)
    columns = {name: chosen.astype(int) for name, chosen in groups.items()}
    mf.files.write_points(Path("groups.ply"), mf.files.PointTable(points, columns))
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    shape = np.full((count, 3), 0.02), turned, np.full(count, 0.9), np.zeros((count, 3)), np.zeros((count, 0, 3))
    mf.splats.write_splats("splats.ply", mf.splats.Splats(points, *shape))
    ends = {"handles": [{"center": top.tolist(), "radius": 0.3, "shift": [0, 0, 0.1]}]}
    ends["anchors"] = [{"center": low.tolist(), "radius": 0.3}]
    Path("handles.json").write_text(json.dumps(ends))
    return top, low


def main():
    """Call all of them."""
    top, low = prepare()
    start = [option("at", top)]
    given = dict.fromkeys(["geodesic-distance", "nearest-source", "unwrap", "extend-direction"], start)
    given |= {verb: ["--reference", "groups.ply"] for verb in ("align", "compare", "transfer-attributes")}
    given |= {
        "simulate": [*start, "--frames", "4"],
        "signed-distance": ["--curve", "curve.npy"],
        "profile": [option("from", top), option("to", low)],
        "minimal-surface": ["--steps", "2"],
        "deform": ["--handles", "handles.json"],
        "tiles run": ["--out-dir", "tiles"],
        "tiles cut": ["--out-dir", "cut"],
    }
    inputs = {"splat-info": "splats.ply", "report": "reports"}
    inputs |= {f"tiles {stage}": "tiles" for stage in ("survey", "agree", "measure", "modes", "report")}
    for verb in make_verbs():
        output = f"{verb.name}{verb.outputs[0]}" if verb.outputs else ""
        more = ["--out", output] if output else []
        more += ["--report", "reports/1.jsonl"] if verb.name != "report" else []
        code, line = call(verb.name, inputs.get(verb.name, "groups.ply"), *given.get(verb.name, []), *more)
        told = line.get("error", "done" if not output or Path(output).stat().st_size else "nothing written")
        print(verb.name, code, told)


if __name__ == "__main__":
    main()
