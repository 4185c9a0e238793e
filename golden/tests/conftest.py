# SPDX-License-Identifier: Apache-2.0
"""Settings of the property tests, and signals as a terminal leaves them."""

import signal

from hypothesis import Phase, settings

from plenofir.commands import app, console
from plenofir.refocus import first_calls

# Speed is measured by benchmarks, never by tests.
settings.register_profile("plenofir", deadline=None, print_blob=True)
# For mutants: the first failure is enough, no simpler one is searched.
settings.register_profile(
    "first_failure", settings.get_profile("plenofir"), phases=(Phase.explicit, Phase.generate)
)
settings.load_profile("plenofir")

# On a slow machine lines of progress would stand beside the messages under test.
console.QUIET_SECONDS = app.COMPILING_SECONDS = 1e6

# Tests of `refocus` are tests of its compiled code.
first_calls.patient = True

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell starts what runs in the background so; the commands under test would inherit it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
