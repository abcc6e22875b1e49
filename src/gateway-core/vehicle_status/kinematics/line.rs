//! Slope of one quantity against another, in addition to an offset and a part that grows with the speed, and
//! its uncertainty.

/// Rows of a block; blocks are left out one by one to estimate the uncertainty of the slope.
const BLOCK: usize = 10;
/// Minimum number of blocks for an estimate.
const MIN_BLOCKS: usize = 5;
/// Multiple of the average residual in turns above which a row is left out, because of slipping wheels.
const OUTLIER: f64 = 6.0;
/// Standard deviations of an interval based on many blocks.
const DEVIATIONS: f64 = 2.5;
/// Additional standard deviations for a single block.
const FEW_BLOCKS: f64 = 6.0;
/// Heading rate above which a vehicle turns, rad/s.
const TURNING_RADPS: f64 = 0.05;
/// Minimum change of the heading in a turn, rad.
const TURN_RAD: f64 = 0.17;
/// Maximum number of cells from one row of a turn to the next.
const MAX_GAP: u64 = 5;

/// One row: `y = slope · x + a + b · speed`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    /// Number of the time cell.
    pub(super) cell: u64,
    /// Speed, m/s, signed.
    pub(super) speed: f64,
    /// The quantity with less noise.
    pub(super) x: f64,
    /// The quantity with more noise.
    pub(super) y: f64,
}

/// A slope with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// Change of `y` per unit of `x`.
    pub(super) slope: f64,
    /// Half of the interval that holds the slope; infinite if there are too few rows.
    pub(super) half: f64,
    /// Number of turns it is based on.
    pub(super) turns: usize,
}

impl Line {
    /// Fits rows in order of time. `rate` converts `y` to a heading rate, rad/s. Returns `None` if the rows
    /// do not determine the slope.
    pub(super) fn fit(rows: &[Row], rate: f64, cell_s: f64) -> Option<Self> {
        let residuals = Sums::of(rows)?.residuals(rows)?;
        let turning = rows.iter().zip(&residuals).filter(|(_, residual)| residual.is_turning(rate));
        let limit = OUTLIER * mean(turning.map(|(_, residual)| residual.rest.abs()))?;
        let is_kept = |residual: &Residual| residual.rest.abs() <= limit;
        let kept = rows.iter().zip(&residuals).filter(|(_, residual)| is_kept(residual));
        let kept: Vec<_> = kept.map(|(row, _)| *row).collect();
        let sums = Sums::of(&kept)?;
        let residuals = sums.residuals(&kept)?;
        let turned = kept.iter().zip(&residuals).map(|(row, residual)| (row.cell, residual.turned * rate));
        Some(Self {
            slope: sums.slope(),
            half: sums.half().unwrap_or(f64::INFINITY),
            turns: turns(turned, cell_s),
        })
    }

    /// Returns true if the whole interval has one sign.
    pub(super) fn has_sign(&self) -> bool {
        self.slope.abs() > self.half
    }
}

/// Remainders of `y` in a row.
struct Residual {
    /// Remainder without the offset and the part that grows with the speed.
    turned: f64,
    /// Remainder that also lacks the part of the slope.
    rest: f64,
}

impl Residual {
    fn is_turning(&self, rate: f64) -> bool {
        (self.turned * rate).abs() > TURNING_RADPS
    }
}

/// Sums of each block.
struct Sums(Vec<Block>);

/// Sums over one block, for quantities without the offset and the part that grows with the speed.
#[derive(Clone, Copy, Default)]
struct Block {
    /// Sum of `x²`.
    squares: f64,
    /// Sum of `x · y`.
    products: f64,
}

impl Sums {
    fn of(rows: &[Row]) -> Option<Self> {
        let (x, y) = (without_speed(rows, |row| row.x)?, without_speed(rows, |row| row.y)?);
        let block = |(x, y): (&[f64], &[f64])| Block {
            squares: x.iter().map(|x| x * x).sum(),
            products: x.iter().zip(y).map(|(x, y)| x * y).sum(),
        };
        let sums = Self(x.chunks(BLOCK).zip(y.chunks(BLOCK)).map(block).collect());
        sums.slope().is_finite().then_some(sums)
    }

    fn total(&self) -> Block {
        let add = |sum: Block, block: &Block| Block {
            squares: sum.squares + block.squares,
            products: sum.products + block.products,
        };
        self.0.iter().fold(Block::default(), add)
    }

    fn slope(&self) -> f64 {
        let total = self.total();
        total.products / total.squares
    }

    fn residuals(&self, rows: &[Row]) -> Option<Vec<Residual>> {
        let slope = self.slope();
        let rests = without_speed(rows, |row| slope.mul_add(-row.x, row.y))?;
        let residual = |(row, rest): (&Row, f64)| Residual { turned: slope.mul_add(row.x, rest), rest };
        Some(rows.iter().zip(rests).map(residual).collect())
    }

    /// Returns half of the interval of the slope, by leaving out one block after another.
    fn half(&self) -> Option<f64> {
        if self.0.len() < MIN_BLOCKS {
            return None;
        }
        let total = self.total();
        let without = |block: &Block| (total.products - block.products) / (total.squares - block.squares);
        let slopes = self.0.iter().map(without);
        let middle = mean(slopes.clone())?;
        let deviation = slopes.map(|slope| (slope - middle).powi(2)).sum::<f64>().sqrt();
        // The number of blocks of equal weight that would be equally informative.
        let effective = total.squares.powi(2) / self.0.iter().map(|block| block.squares.powi(2)).sum::<f64>();
        let half = deviation * (DEVIATIONS + FEW_BLOCKS / effective);
        half.is_finite().then_some(half)
    }
}

/// Returns a quantity without its offset and the part that grows with the speed.
fn without_speed(rows: &[Row], quantity: impl Fn(&Row) -> f64) -> Option<Vec<f64>> {
    let (speed, middle) = (mean(rows.iter().map(|row| row.speed))?, mean(rows.iter().map(&quantity))?);
    let squares = rows.iter().map(|row| (row.speed - speed).powi(2)).sum::<f64>();
    let products = rows.iter().map(|row| (row.speed - speed) * (quantity(row) - middle)).sum::<f64>();
    let growth = if squares > 0.0 { products / squares } else { 0.0 };
    Some(rows.iter().map(|row| quantity(row) - middle - growth * (row.speed - speed)).collect())
}

/// Returns the number of turns among heading rates, rad/s, by the cells of time.
fn turns(rates: impl Iterator<Item = (u64, f64)>, cell_s: f64) -> usize {
    let (mut turns, mut turned, mut last) = (0, 0.0_f64, 0);
    for (cell, rate) in rates {
        let continues = cell - last <= MAX_GAP && rate * turned >= 0.0 && rate.abs() > TURNING_RADPS;
        if !continues {
            turned = 0.0;
        }
        last = cell;
        if rate.abs() > TURNING_RADPS {
            let before = turned.abs();
            turned += rate * cell_s;
            turns += usize::from(before < TURN_RAD && turned.abs() >= TURN_RAD);
        }
    }
    turns
}

/// Returns the mean; `None` without values.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    (count > 0.0).then(|| sum / count)
}
