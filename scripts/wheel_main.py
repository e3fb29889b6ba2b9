"""The program `meshfree` as `python -m meshfree_laplacian`, of which this is `__main__.py` in the wheel."""

import sys

from meshfree_laplacian.command.main import main

sys.exit(main())
