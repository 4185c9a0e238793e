"""Settings of the property tests: speed is measured by benchmarks, never by tests."""

from hypothesis import settings

settings.register_profile("plenofir", deadline=None, print_blob=True)
settings.load_profile("plenofir")
