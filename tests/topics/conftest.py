"""Property tests draw the same examples everywhere, and no clock judges them."""

from hypothesis import settings

settings.register_profile("topics", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("topics")
