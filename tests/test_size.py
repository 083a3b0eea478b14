"""The project stays small enough for a newcomer; a commit that raises a limit says why."""

from support.size import count_lines, read_limits


def test_no_part_has_more_lines_than_its_limit():
    lines, limits = count_lines(), read_limits()
    assert {part: n for part, n in lines.items() if n > limits[part]} == {}


def test_the_limits_leave_no_room_for_a_folder():
    """A limit far above today's number holds nothing."""
    lines, limits = count_lines(), read_limits()
    assert {part: n for part, n in lines.items() if n < limits[part] - 500} == {}
