"""`python -m pmor`: the command line."""

import sys

from pmor.app.cli import main

sys.exit(main())
