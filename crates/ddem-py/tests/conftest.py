"""Asserts of what the tests share say what they compared."""

import pytest

pytest.register_assert_rewrite("attempts", "small")
