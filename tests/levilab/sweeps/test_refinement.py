"""Yes/no maps that are known, refined along their boundary: what is computed, what is missed, what is promised."""

import numpy as np
import pytest
from scipy.stats import beta

from levilab.sweeps.refinement import AUDIT, Audit, refine


def islands(seed, shape=(120, 160), count=15, largest=3.0):
    """A wavy edge, and round islands on either side of it, most of them smaller than the coarse grid's cells."""
    random = np.random.default_rng(seed)
    y, x = np.indices(shape)
    values = x + 10 * np.sin(y / 20) > 0.4 * shape[1]
    for _ in range(count):
        place, radius = random.uniform((0, 0), shape), random.uniform(0.5, largest)
        values ^= (y - place[0]) ** 2 + (x - place[1]) ** 2 < radius**2
    return values


def refined(values, **how):
    return refine(lambda points, _: values.flat[points], values.shape, **how)


def test_what_was_computed_is_right_and_every_edge_has_it_on_both_sides():
    values = islands(1)
    found = refined(values)
    assert np.array_equal(found.values[found.computed], values[found.computed])
    for axis in (0, 1):
        here, there = (np.moveaxis(found.values, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
        both = np.moveaxis(found.computed, axis, 0)
        assert np.all((both[:-1] & both[1:])[here != there])
    assert found.saved > 0.6


def test_an_island_as_large_as_the_stride_is_seen_wherever_it_lies():
    random = np.random.default_rng(0)
    for _ in range(100):
        values = np.zeros((70, 81), dtype=np.bool_)
        y, x = random.integers((0, 0), (70 - 8, 81 - 8), endpoint=True)
        values[y : y + 8, x : x + 8] = True
        found = refined(values, audit=1)
        assert found.strides == (8, 8)
        assert np.array_equal(found.values, values), (y, x)


def test_the_missed_points_are_within_the_limit_in_95_of_100_maps():
    within, missed = 0, 0
    for seed in range(60):
        values = islands(seed)
        found = refined(values, seed=seed, audit=150)
        wrong = np.count_nonzero(found.values != values)
        missed += wrong
        within += wrong <= found.most_wrong
    assert within >= 57
    assert missed > 60  # small islands are missed: there was something to limit


def test_the_limit_of_the_second_audit_alone_holds_in_95_percent():
    # one confined to its own audit, with no repair on its side: 3 standard errors of a share of 95 % in 2000 trials
    random = np.random.default_rng(3)
    found = random.hypergeometric(40, 1960, 200, size=2000)
    limits = {int(k): Audit(2000, 200, int(k)).most_wrong for k in np.unique(found)}
    assert np.mean([limits[int(k)] >= 40 for k in found]) >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / 2000)


@pytest.mark.parametrize(("wrong", "computed"), [(0, 300), (3, 300), (10, 50)])
def test_the_limit_is_that_of_clopper_and_pearson_where_much_was_filled_in(wrong, computed):
    expected = beta.ppf(0.95, wrong + 1, computed - wrong)
    many = Audit(10_000_000, computed, wrong).most_wrong / 10_000_000
    assert many == pytest.approx(expected, rel=1e-3)  # a sample of 3e-5 of the points is as good as put back


def test_where_all_was_audited_the_limit_is_what_was_wrong():
    assert Audit(50, 50, 0).most_wrong == 0
    assert Audit(50, 50, 7).most_wrong == 7
    assert Audit(0, 0, 0).most_wrong == 0


def test_a_second_refinement_asks_for_the_same_points():
    values = islands(4)
    asked = [], []
    for questions in asked:

        def answer(points, _, questions=questions):
            questions.append(points.tobytes())
            return values.flat[points]

        refine(answer, values.shape)
    assert len(asked[0]) > 5
    assert asked[0] == asked[1]


@pytest.mark.parametrize("shape", [(2, 2), (1, 40), (3, 5, 40), (33,), (9, 17, 25)])
def test_maps_of_every_shape_are_refined_to_their_end(shape):
    values = np.indices(shape).sum(axis=0) > sum(shape) / 3
    found = refined(values, audit=10)
    assert np.array_equal(found.values, values)


def test_a_map_of_one_value_needs_few_points():
    found = refined(np.ones((200, 200), dtype=np.bool_))
    assert found.computed.sum() == 26 * 26 + 2 * AUDIT
    assert found.most_wrong_share < 0.01


def test_a_stride_that_is_no_power_of_two_is_refused():
    with pytest.raises(ValueError, match="a power of 2"):
        refined(np.zeros((10, 10), dtype=np.bool_), stride=6)
