"""What holds for all tests."""

import hypothesis

# No deadlines, as nothing here is about time, and the same examples everywhere, so that a failure can be had again.
hypothesis.settings.register_profile("everywhere", deadline=None, derandomize=True)
hypothesis.settings.load_profile("everywhere")
