"""Each closed form of a view factor beside a second way: an integral of another kind, or lines at random."""

import numpy as np
import pytest
from cases import cases

from validation.oracle.view_factors import cylinders, discs, rectangles, spheres, strings
from validation.oracle.view_factors.polygons import element_to_polygon, mean_over_rectangle
from validation.oracle.view_factors.quadrature import integral
from validation.oracle.view_factors.rectangles import Span
from validation.oracle.view_factors.strings import Point, Segment

SEED = 2053


def midpoints(low, high, count):
    return low + (high - low) * (np.arange(count) + 0.5) / count


class TestPolygons:
    def test_a_point_under_a_large_square_sees_all_of_it(self):
        square = 1e8 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) + [0, 0, 1]
        assert element_to_polygon([0, 0, 0], [0, 0, 5], square) == pytest.approx(1.0, abs=1e-15)
        assert element_to_polygon([0, 0, 0], [1, 0, 0], square) == pytest.approx(0.5, abs=1e-8)
        assert element_to_polygon([0, 0, 2], [0, 0, 1], square) == 0.0

    @cases("normal", [(0.0, 0.0, 1.0), (0.3, -0.2, 1.0), (1.0, 0.5, 0.0)])
    def test_it_is_the_integral_over_the_polygon(self, normal):
        """The last normal is level, so that the point's plane cuts the polygon: both have to leave out a part."""
        up = np.array(normal) / np.linalg.norm(normal)
        point, corner, along, aside = (
            np.zeros(3),
            np.array([-0.4, -0.7, 1.1]),
            np.array([1.6, 0.1, 0.3]),
            [0.2, 1.9, 0.0],
        )
        s, t = np.meshgrid(midpoints(0, 1, 1000), midpoints(0, 1, 1000))
        places = corner + s[..., None] * along + t[..., None] * aside
        square = np.einsum("...x,...x->...", places, places)
        area = np.cross(along, aside)
        kernel = np.maximum(places @ up, 0.0) * np.abs(places @ area) / (np.pi * square**2)
        corners = [corner, corner + along, corner + along + aside, corner + aside]
        # Midpoints of a million cells err by 2e-7; of four times as many, by a quarter of that.
        found = element_to_polygon(point, normal, corners)
        assert found == pytest.approx(kernel.mean(), rel=1e-6)
        assert element_to_polygon(point, normal, corners[::-1]) == pytest.approx(found, rel=1e-14)


class TestRectangles:
    @cases("a, b, c", [(1.0, 1.0, 1.0), (2.0, 0.5, 0.3), (1.0, 4.0, 7.0)])
    def test_parallel(self, a, b, c):
        found = rectangles.parallel(a, b, c)
        own = (Span(0.0, a), Span(3.0, 3.0 + b))
        assert rectangles.parallel_exchange(own, own, c) / (a * b) == pytest.approx(found, rel=1e-12)
        here = np.array([[0.0, 0, 0], [a, 0, 0], [a, b, 0], [0, b, 0]])
        assert mean_over_rectangle(here, [0, 0, 1], here + np.array([0, 0, c])) == pytest.approx(found, rel=1e-8)

    @cases("w, h, l", [(1.0, 1.0, 1.0), (2.0, 0.5, 0.3), (1.0, 4.0, 7.0)])
    def test_perpendicular(self, w, h, l):  # noqa: E741
        found = rectangles.perpendicular(w, h, l)
        floor, wall = (Span(0.0, w), Span(-1.0, l - 1.0)), (Span(-1.0, l - 1.0), Span(0.0, h))
        assert rectangles.perpendicular_exchange(floor, wall) / (w * l) == pytest.approx(found, rel=1e-12)
        here = np.array([[0.0, 0, 0], [w, 0, 0], [w, l, 0], [0, l, 0]])
        beside = np.array([[0.0, 0, 0], [0, l, 0], [0, l, h], [0, 0, h]])
        # At the shared edge the integrand jumps from 1/2 to what is there: the points crowd there.
        assert mean_over_rectangle(here, [0, 0, 1], beside, 48) == pytest.approx(found, rel=1e-7)

    def test_apart_and_askew(self):
        one, two = (Span(0.0, 1.0), Span(0.0, 2.0)), (Span(0.7, 3.0), Span(-1.0, 0.5))
        here = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]])
        over = np.array([[0.7, -1, 0.4], [3, -1, 0.4], [3, 0.5, 0.4], [0.7, 0.5, 0.4]])
        known = 2.0 * mean_over_rectangle(here, [0, 0, 1], over, 64)
        assert rectangles.parallel_exchange(one, two, 0.4) == pytest.approx(known, rel=1e-9)
        floor, wall = (Span(0.5, 1.5), Span(0.0, 2.0)), (Span(1.0, 4.0), Span(0.2, 0.9))
        beside = np.array([[0.0, 1, 0.2], [0, 4, 0.2], [0, 4, 0.9], [0, 1, 0.9]])
        known = 2.0 * mean_over_rectangle(here + np.array([0.5, 0, 0]), [0, 0, 1], beside)
        assert rectangles.perpendicular_exchange(floor, wall) == pytest.approx(known, rel=1e-9)

    def test_rooms_are_closed(self):
        a, b, c = 3.0, 2.0, 0.7
        row = rectangles.parallel(a, b, c)
        row += 2.0 * (rectangles.perpendicular(a, c, b) + rectangles.perpendicular(b, c, a))
        assert row == pytest.approx(1.0, abs=1e-13)
        assert a * rectangles.perpendicular(a, c, b) == pytest.approx(c * rectangles.perpendicular(c, a, b), rel=1e-12)


class TestDiscs:
    @cases("one, two, far", [(1.0, 1.0, 1.0), (1.0, 2.0, 1.0), (0.5, 1.0, 2.0), (3.0, 0.1, 0.2)])
    def test_coaxial_discs_are_the_mean_of_elements(self, one, two, far):
        kinks = sorted({0.0, one, min(two, one)})
        rings = integral(lambda p: 2.0 * p * discs.element_to_disc(p, two, far), kinks, 80) / one**2
        assert discs.coaxial(one, two, far) == pytest.approx(rings, rel=1e-9)
        back = discs.coaxial(two, one, far) * (two / one) ** 2
        assert discs.coaxial(one, two, far) == pytest.approx(back, rel=1e-12)

    @cases("aside", [0.0, 0.4, 1.0, 2.5])
    def test_an_element_sees_a_disc_as_a_polygon_of_the_same_area(self, aside):
        count, far = 2000, 0.6
        angle = 2.0 * np.pi * np.arange(count) / count
        radius = 1.0 / np.sqrt(np.sin(angle[1]) / angle[1])
        corners = np.stack([radius * np.cos(angle) - aside, radius * np.sin(angle), np.full(count, far)], axis=1)
        # Between both outlines lies (2 pi / 2000)^2 / 12 of the area.
        known = element_to_polygon([0, 0, 0], [0, 0, 1], corners)
        assert discs.element_to_disc(aside, 1.0, far) == pytest.approx(known, rel=1e-6)

    BETWEEN = (
        (1.0, 1.0, 2.0, 0.5, 0.5),
        (1.0, 0.6, 1.0, 0.3, 0.25),
        (0.5, 2.0, 1.5, 0.7, 0.6),
        (1.0, 2.0, 0.5, 0.05, 0.9),
    )

    @cases("one, two, far, between, share", BETWEEN)
    def test_lines_through_three_discs_are_those_that_come_back(self, one, two, far, between, share):
        there = discs.through_disc(one, two, far, between, share)
        back = discs.through_disc(two, one, far, between, 1.0 - share)
        assert there == pytest.approx(back, rel=1e-10)

    @cases("one, two, far, between, share", BETWEEN)
    def test_lines_through_three_discs_one_by_one(self, one, two, far, between, share):
        """Points of the first and the third disc, by rings of equal area and the angle between them: the kernel, where
        the line goes on to the second disc.
        """
        p2, q2 = np.meshgrid(one**2 * midpoints(0, 1, 150), between**2 * midpoints(0, 1, 150), indexing="ij")
        cosine, p, q = np.cos(midpoints(0, np.pi, 300)), np.sqrt(p2)[..., None], np.sqrt(q2)[..., None]
        square, near = p**2 + q**2 - 2.0 * p * q * cosine, share * far
        # The line from p through q ends at p + (q - p) / share.
        back = 1.0 / share - 1.0
        ends = (back * p) ** 2 + (q / share) ** 2 - 2.0 * back / share * p * q * cosine
        kernel = near**2 / (np.pi * (square + near**2) ** 2) * (ends <= two**2)
        area = np.pi * one**2 * np.pi * between**2
        # Cells that the second disc's outline cuts are right or wrong by chance.
        assert discs.through_disc(one, two, far, between, share) == pytest.approx(area * kernel.mean(), rel=1e-3)

    def test_a_third_disc_hides_all_or_nothing(self):
        whole = discs.coaxial(1.0, 1.0, 2.0)
        assert discs.with_disc_between(1.0, 1.0, 2.0, 1.0, 0.5) < 1e-12
        assert discs.with_disc_between(1.0, 1.0, 2.0, 1e-6, 0.5) == pytest.approx(whole, abs=1e-11)
        hidden = [discs.with_disc_between(1.0, 1.0, 2.0, r, 0.5) for r in (0.2, 0.4, 0.6, 0.8)]
        assert sorted(hidden, reverse=True) == hidden


class TestSpheres:
    @cases("angle", [0.0, 0.5, 1.1, 1.4, np.pi / 2, 1.9, 2.2, 3.0])
    def test_an_element_sees_the_directions_to_a_sphere(self, angle):
        half = np.arcsin(1.0 / 1.5)
        turn, around = np.meshgrid(midpoints(0, half, 1500), midpoints(0, np.pi, 1500))
        height = np.cos(angle) * np.cos(turn) + np.sin(angle) * np.sin(turn) * np.cos(around)
        known = 2.0 * half * np.mean(np.maximum(height, 0.0) * np.sin(turn))
        assert spheres.element_to_sphere(angle, 1.5, 1.0) == pytest.approx(known, abs=1e-6)

    @cases("disc, far", [(1.0, 1.0), (3.0, 0.8), (0.2, 4.0)])
    def test_a_disc_sees_a_sphere_as_the_mean_of_its_elements(self, disc, far):
        radius = 0.75

        def ring(p):
            away = float(np.hypot(p, far))
            return 2.0 * p / disc**2 * spheres.element_to_sphere(float(np.arccos(far / away)), away, radius)

        assert spheres.from_disc(radius, disc, far) == pytest.approx(integral(ring, [0.0, disc]), rel=1e-12)

    @cases("one, two, far", [(1.0, 1.0, 2.0), (1.0, 3.0, 4.5), (0.1, 1.0, 1.2), (1.0, 1.0, 50.0)])
    def test_spheres_see_each_other_alike(self, one, two, far):
        there, back = spheres.to_sphere(one, two, far), spheres.to_sphere(two, one, far)
        assert there * one**2 == pytest.approx(back * two**2, rel=1e-9)
        # From afar a sphere is a point: half of what its disc covers.
        if far == 50.0:
            assert there == pytest.approx(0.25 * (two / far) ** 2, rel=1e-3)

    def test_lines_from_a_sphere_reach_another_one(self):
        rng, count = np.random.default_rng(SEED), 400_000
        start = rng.normal(size=(count, 3))
        start /= np.linalg.norm(start, axis=1, keepdims=True)
        way = rng.normal(size=(count, 3))
        # The normal and a point of the unit sphere: by cosine.
        way = start + way / np.linalg.norm(way, axis=1, keepdims=True)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        off = np.array([2.5, 0.0, 0.0]) - start
        along = np.einsum("ij,ij->i", off, way)
        share = ((along > 0.0) & (np.einsum("ij,ij->i", off, off) - along**2 < 1.2**2)).mean()
        known = spheres.to_sphere(1.0, 1.2, 2.5)
        assert abs(share - known) < 4.0 * np.sqrt(known / count)


class TestCylinders:
    CASES = ((1.0, 2.0, 3.0), (1.0, 1.2, 0.5), (0.3, 2.0, 1.0), (1.0, 1.5, 40.0))

    @staticmethod
    def heights(square, length):
        """The integral of 1 / (k^2 + (z1 - z2)^2)^2 over both heights, by the difference u of heights."""
        k = np.sqrt(square)
        inside = length / (2.0 * square * (square + length**2)) + np.arctan(length / k) / (2.0 * k**3)
        return 2.0 * (length * inside + 0.5 / (square + length**2) - 0.5 / square)

    @cases("inner, outer, length", CASES)
    def test_outer_to_inner(self, inner, outer, length):
        def angle(turn):
            square = inner**2 + outer**2 - 2.0 * inner * outer * np.cos(turn)
            sides = (outer * np.cos(turn) - inner) * (outer - inner * np.cos(turn))
            return sides / np.pi * self.heights(square, length)

        whole = 2.0 * np.pi * inner * outer * 2.0 * integral(angle, [0.0, float(np.arccos(inner / outer))])
        known = whole / (2.0 * np.pi * outer * length)
        assert cylinders.to_inner(inner, outer, length) == pytest.approx(known, rel=1e-9)

    @cases("inner, outer, length", CASES)
    def test_outer_to_itself(self, inner, outer, length):
        def angle(turn):
            square = 2.0 * outer**2 * (1.0 - np.cos(turn))
            return square**2 / (4.0 * outer**2 * np.pi) * self.heights(square, length)

        whole = 2.0 * np.pi * outer**2 * 2.0 * integral(angle, [0.0, 2.0 * float(np.arccos(inner / outer))])
        known = whole / (2.0 * np.pi * outer * length)
        assert cylinders.to_itself(inner, outer, length) == pytest.approx(known, rel=1e-7)


class TestStrings:
    @cases("tips", [[], [Point(2.0, 1.5)], [Point(1.0, 1.0), Point(1.5, 1.0)], [Point(0.5, 2.5), Point(3.9, 0.5)]])
    def test_walls_past_a_block(self, tips):
        """From each place of a wall: half the difference of the sines to the top and to what the block lets see."""
        width, left, right = 4.0, (0.5, 2.8), (0.25, 3.5)
        z = midpoints(*left, 200_000)
        low = np.full(len(z), right[0])
        for tip in tips:
            low = np.maximum(low, z + (tip.z - z) * width / tip.x)
        low = np.minimum(low, right[1])
        top, bottom = (np.sin(np.arctan((end - z) / width)) for end in (right[1], low))
        known = (left[1] - left[0]) * np.mean((top - bottom) / 2.0)
        walls = [Segment(Point(x, a), Point(x, b)) for x, (a, b) in ((0.0, left), (width, right))]
        assert strings.exchange(*walls, tips) == pytest.approx(known, rel=1e-8)
        assert strings.exchange(*walls[::-1], tips) == pytest.approx(known, rel=1e-8)

    def test_a_wall_half_as_high_halves_what_walls_exchange(self):
        walls = [Segment(Point(x, 0.0), Point(x, 3.0)) for x in (0.0, 4.0)]
        assert strings.exchange(*walls, [Point(2.0, 1.5)]) == 0.5 * strings.exchange(*walls) == 0.5

    def test_a_floor_beside_a_block_and_the_wall_behind_it(self):
        """The floor ends at the block's foot, so that its string goes straight up."""
        floor, wall = Segment(Point(0.0, 0.0), Point(1.0, 0.0)), Segment(Point(4.0, 0.0), Point(4.0, 3.0))
        tips = [Point(1.0, 1.0), Point(2.0, 1.0)]
        x = midpoints(0.0, 1.0, 200_000)
        low = np.minimum(1.0 / (1.0 - x) * (4.0 - x), 3.0)
        known = np.mean((4.0 - x) / np.hypot(4.0 - x, low) - (4.0 - x) / np.hypot(4.0 - x, 3.0)) / 2.0
        found = strings.exchange(floor, wall, tips)
        # The floor's element sees angles from the level: half of cos(low) - cos(high).
        assert found == pytest.approx(known, rel=1e-8)
