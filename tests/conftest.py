"""What holds for all tests."""

from hypothesis import settings

from bench.compilation import attend

# A kernel's first call compiles it, and the machine may be busy: time decides nothing here.
settings.register_profile("trackmark", deadline=None)
settings.load_profile("trackmark")

attend()  # tests run side by side
