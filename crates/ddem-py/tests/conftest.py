"""Makes asserts in shared test modules show the compared values."""

import pytest

pytest.register_assert_rewrite("fuzz_calls", "sample_models")
