//! A random road that meets itself: its recipe, and the limits within which it is drawn.

use lanelet2_map::geometry::{Pose, wrapped};
use lanelet2_map::lane_network::{LaneId, TurnDirection};
use proptest::prelude::*;

use super::drawn_road::Piece::{Arc, Straight};
use super::drawn_road::{DrawnRoad, Piece, drawn};

/// The shortest piece, metres.
const MIN_PIECE_M: f64 = 5.0;
/// A vehicle does not pass more of its route than this from one decision to the next, metres.
const MAX_STEP_M: f64 = 20.0;
/// On lanelets whose middles are nearer than this and face alike to within so many degrees, a vehicle is on
/// both.
const SAME_PLACE_M: f64 = 2.0;
const SAME_HEADING_DEG: f64 = 15.0;

/// A road to be drawn. Turns are to the left where it does not say otherwise, and to the other side if it is
/// mirrored.
#[derive(Debug, Clone)]
pub(crate) struct LoopRecipe {
    shape: Shape,
    /// Which of its bends are tagged, over and over.
    tagged: Vec<bool>,
    is_mirrored: bool,
    /// So many of its last pieces are left out: its goal is before them.
    before_end: usize,
    ids: IdOrder,
    speed_mps: f64,
}

#[derive(Debug, Clone)]
enum Shape {
    /// A way in, once around a block, and on, beside the first time or on top of it.
    Block {
        way_in_m: f64,
        /// It is joined after a turn to the other side.
        after_turn: bool,
        sides_m: [f64; 2],
        radius_m: f64,
        /// So far to the left of the first time, metres.
        beside_m: f64,
        /// The last side of the block leads to the first one as well.
        forks: bool,
    },
    /// Back beside the way in, and off to the right there.
    Teardrop {
        way_in_m: f64,
        radius_m: f64,
        degrees: f64,
        off_radius_m: f64,
        off_degrees: f64,
        way_out_m: f64,
    },
    /// Across the way in, and back to it from the other side.
    Eight { way_in_m: f64, radii_m: [f64; 2], beyond_m: f64, beside_m: f64, on_m: f64, off_degrees: f64 },
    /// Straights and bends as they come: length, radius, degrees.
    Any(Vec<(f64, f64, f64)>),
}

/// The order of the ids along the road.
#[derive(Debug, Clone)]
enum IdOrder {
    Ascending,
    Descending,
    /// The last so many come first.
    Rotated(usize),
    /// By these keys.
    Shuffled(Vec<u32>),
}

/// More pieces than any road has.
const MAX_PIECES: usize = 32;

pub(crate) fn any_loop() -> impl Strategy<Value = LoopRecipe> {
    use proptest::collection::vec;
    let beside = || prop_oneof![Just(0.0), -4.0..4.0_f64];
    let radius = || 6.0..20.0_f64;
    let block = (
        10.0..120.0_f64,
        any::<bool>(),
        [2.0 * MIN_PIECE_M..90.0, 2.0 * MIN_PIECE_M..90.0],
        radius(),
        beside(),
        any::<bool>(),
    )
        .prop_map(|(way_in_m, after_turn, sides_m, radius_m, beside_m, forks)| Shape::Block {
            way_in_m,
            after_turn,
            sides_m,
            radius_m,
            beside_m,
            forks,
        });
    let teardrop =
        (20.0..100.0_f64, 8.0..25.0_f64, 280.0..345.0_f64, radius(), 50.0..150.0_f64, MIN_PIECE_M..60.0)
            .prop_map(|(way_in_m, radius_m, degrees, off_radius_m, off_degrees, way_out_m)| {
                Shape::Teardrop { way_in_m, radius_m, degrees, off_radius_m, off_degrees, way_out_m }
            });
    let off = prop_oneof![-120.0..-50.0_f64, 50.0..120.0_f64];
    let eight = (20.0..100.0_f64, [radius(), radius()], 0.0..40.0_f64, beside(), MIN_PIECE_M..80.0, off)
        .prop_map(|(way_in_m, radii_m, beyond_m, beside_m, on_m, off_degrees)| Shape::Eight {
            way_in_m,
            radii_m,
            beyond_m,
            beside_m,
            on_m,
            off_degrees,
        });
    let degrees = prop_oneof![3 => 50.0..150.0_f64, 1 => -150.0..-50.0_f64, 1 => 150.0..300.0_f64];
    let any_shape = vec((MIN_PIECE_M..60.0, radius(), degrees), 2..8).prop_map(Shape::Any);
    let shape = prop_oneof![3 => block, 1 => teardrop, 2 => eight, 2 => any_shape];
    let ids = prop_oneof![
        Just(IdOrder::Ascending),
        Just(IdOrder::Descending),
        (1..MAX_PIECES).prop_map(IdOrder::Rotated),
        vec(any::<u32>(), MAX_PIECES).prop_map(IdOrder::Shuffled),
    ];
    let tagged = prop_oneof![2 => Just(vec![true]), 1 => vec(any::<bool>(), 1..6)];
    (shape, tagged, any::<bool>(), 0..14_usize, ids, 2.0..15.0_f64).prop_map(
        |(shape, tagged, is_mirrored, before_end, ids, speed_mps)| LoopRecipe {
            shape,
            tagged,
            is_mirrored,
            before_end,
            ids,
            speed_mps,
        },
    )
}

impl LoopRecipe {
    /// The law that it breaks, with what was driven; `None` as well where the road is not within the limits.
    pub(crate) fn broken(&self) -> Result<Option<String>, &'static str> {
        let (pieces, joints) = self.pieces();
        if pieces.iter().any(|piece| piece.length_m() < MIN_PIECE_M) {
            return Err("a piece is too short");
        }
        if is_on_two_lanelets(&pieces) {
            return Err("the vehicle is on two lanelets of its route, and may have come to both");
        }
        let ids = self.ids.of(pieces.len());
        let drawn = DrawnRoad::new(&pieces, &ids, &joints);
        let law = drawn.broken(self.speed_mps).or_else(|| drawn.differing(self.speed_mps));
        let driven =
            |law| format!("{law}\n{pieces:?}, ids {ids:?}, joints {joints:?}, {} m/s", self.speed_mps);
        Ok(law.map(driven))
    }

    /// The pieces of the road, and which of them lead to the start of an earlier one.
    fn pieces(&self) -> (Vec<Piece>, Vec<[usize; 2]>) {
        let (mut pieces, joint) = self.shape.pieces();
        let kept = pieces.len().saturating_sub(self.before_end).max(3);
        pieces.truncate(kept);
        let mut tagged = self.tagged.iter().cycle();
        for piece in &mut pieces {
            let Arc(_, degrees, tag) = piece else { continue };
            *degrees = if self.is_mirrored { -*degrees } else { *degrees };
            *tag = match tagged.next() {
                Some(true) if *degrees > 0.0 => TurnDirection::Left,
                Some(true) => TurnDirection::Right,
                Some(false) | None => TurnDirection::None,
            };
        }
        (pieces, joint.filter(|[from, _]| *from < kept).into_iter().collect())
    }
}

impl Shape {
    /// Its pieces, not tagged yet, and which of them leads to the start of an earlier one.
    fn pieces(&self) -> (Vec<Piece>, Option<[usize; 2]>) {
        let arc = |radius_m, degrees| Arc(radius_m, degrees, TurnDirection::None);
        match *self {
            Self::Block { way_in_m, after_turn, sides_m: [one_m, other_m], radius_m, beside_m, forks } => {
                // The first side is in two halves, and the block is joined between them.
                let (half, corner) = (Straight(one_m / 2.0), arc(radius_m, 90.0));
                let mut pieces = vec![Straight(way_in_m)];
                if after_turn {
                    pieces.extend([arc(radius_m, -90.0), Straight(MIN_PIECE_M)]);
                }
                let first = pieces.len();
                pieces.extend([half, corner, Straight(other_m), corner, Straight(one_m), corner]);
                pieces.extend([Straight(other_m - beside_m), corner, half]);
                let last = pieces.len() - 1;
                // And around again.
                pieces.extend([half, corner, Straight(other_m), corner, Straight(one_m)]);
                pieces.extend([arc(radius_m, -60.0), Straight(20.0)]);
                (pieces, forks.then_some([last, first]))
            }
            Self::Teardrop { way_in_m, radius_m, degrees, off_radius_m, off_degrees, way_out_m } => (
                vec![
                    Straight(way_in_m),
                    arc(radius_m, degrees),
                    arc(off_radius_m, -off_degrees),
                    Straight(way_out_m),
                ],
                None,
            ),
            Self::Eight { way_in_m, radii_m: [one_m, other_m], beyond_m, beside_m, on_m, off_degrees } => (
                vec![
                    Straight(way_in_m),
                    Straight(one_m + beyond_m),
                    arc(one_m, 270.0),
                    Straight(one_m + other_m + beside_m),
                    arc(other_m, -270.0),
                    Straight(on_m),
                    arc(one_m, off_degrees),
                    Straight(20.0),
                ],
                None,
            ),
            Self::Any(ref bends) => {
                let pair = |(length_m, radius_m, degrees): &(f64, f64, f64)| {
                    [Straight(*length_m), arc(*radius_m, *degrees)]
                };
                (bends.iter().flat_map(pair).chain([Straight(20.0)]).collect(), None)
            }
        }
    }
}

impl IdOrder {
    fn of(&self, count: usize) -> Vec<LaneId> {
        let mut ids: Vec<LaneId> = (1..).take(count).collect();
        match self {
            Self::Ascending => {}
            Self::Descending => ids.reverse(),
            Self::Rotated(by) => ids.rotate_right(by % count),
            Self::Shuffled(keys) => {
                let mut keyed: Vec<(u32, LaneId)> = keys.iter().copied().zip(ids).collect();
                keyed.sort_unstable();
                ids = keyed.into_iter().map(|(_, id)| id).collect();
            }
        }
        ids
    }
}

/// A vehicle is on two lanelets in the plane, faces as both do, and may have come to both: less than
/// [`MAX_STEP_M`] of the route lies between them. Nothing tells which one is meant.
fn is_on_two_lanelets(pieces: &[Piece]) -> bool {
    let poses = drawn(pieces);
    (0..pieces.len()).any(|one| {
        (one + 2..pieces.len()).any(|other| {
            // The vehicle may have come from the lanelet before either.
            let between = pieces[one + 1..other - 1].iter();
            let between_m: f64 = between.map(|piece| piece.length_m()).sum();
            between_m < MAX_STEP_M && share_a_place(&poses[one], &poses[other])
        })
    })
}

fn share_a_place(one: &[Pose], other: &[Pose]) -> bool {
    let is_same = |one: &Pose, other: &Pose| {
        one.position.distance_m(other.position) < SAME_PLACE_M
            && wrapped(one.yaw_rad - other.yaw_rad).abs() < SAME_HEADING_DEG.to_radians()
    };
    one.iter().any(|one| other.iter().any(|other| is_same(one, other)))
}
