# SPDX-License-Identifier: Apache-2.0
"""Settings of the property tests, and signals as a terminal leaves them."""

import signal

from hypothesis import settings

# Speed is measured by benchmarks, never by tests.
settings.register_profile("plenofir", deadline=None, print_blob=True)
settings.load_profile("plenofir")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell starts what runs in the background so; the commands under test would inherit it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
