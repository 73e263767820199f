from collections import Counter

import pytest

from evaluation.seeding import below, bit_generator, generator, shuffled


def test_the_streams_are_fixed_for_ever():
    # Studies that are running depend on these numbers.
    bits = bit_generator(2013, "demo", "trial order", 0)
    assert [int(word) for word in bits.random_raw(2)] == [969793570366155334, 12106946147560482178]


@pytest.mark.parametrize("other", [(1, "b", "c"), (2, "a", "b"), (1, "a", "b", 0), (1, "ab"), (1, "a\x1fb", "c")])
def test_other_keys_give_another_stream(other):
    assert bit_generator(1, "a", "b").random_raw() != bit_generator(*other).random_raw()


def test_a_number_is_not_its_text():
    assert generator(1, 7).random() != generator(1, "7").random()


def test_below_is_uniform():
    bits = bit_generator(1, "test")
    counts = Counter(below(bits, 3) for _ in range(9000))
    assert set(counts) == {0, 1, 2}
    assert all(abs(count - 3000) < 200 for count in counts.values())


def test_all_orders_come_equally_often():
    bits = bit_generator(1, "test")
    counts = Counter(tuple(shuffled("abc", bits)) for _ in range(6000))
    assert len(counts) == 6
    assert all(abs(count - 1000) < 150 for count in counts.values())
