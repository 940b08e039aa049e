//! Samples that somebody else drew, row by row, as the checks see them.
//!
//! The first rows are pilots: they say where cells are cut, and are judged only by what is certain of a single row. The rest streams through a buffer of half a million rows or so, however many there are. To
//! the checks a row is a variate: the number of the row plus 1 for those that are judged, and less than 1 for a pilot, so that what asks
//! for a few samples of its own is given pilots.

use super::examination::{Against, Examination, examine};
use super::probe::{Draw, Fate, Look, Probe, RoundTrip};
use super::rows::{Block, Blocks, Piece, Rows, RowsError};
use super::settings::Settings;
use crate::domain::{Cell, Domain, Knots, Location, Space, in_short};
use crate::sampler::Preimage;
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard};

/// What a row says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<P> {
    /// The point; `None` for a sample that was rejected.
    pub point: Option<P>,
    /// The density that the sampler gave with it, if there is a column of them.
    pub density: Option<f64>,
    /// f / density of a function that is integrated, if there is a column of it.
    pub weight: Option<f64>,
}

/// Pilots, at least and at most; as a share of the rows that are judged between. Of few rows one in eight is a pilot.
const PILOTS: [u64; 2] = [1 << 14, 1 << 18];
const PILOTS_SHARE: u64 = 64;
const FEW_PILOTS_SHARE: u64 = 8;
/// How many rows are assumed of a pipe whose end nobody knows.
const ASSUMED: u64 = 100_000_000;

/// A density, of a point or of places on the chart, many at once.
enum Judge<'a, P> {
    Point(Box<dyn Fn(&P) -> f64 + Send + Sync + 'a>),
    Places(Box<dyn Fn(&[Location], &mut Vec<f64>) + Send + Sync + 'a>),
}

/// What some rows say, column by column: no time is lost on waiting for what was just written. Every row says the same of itself: a density or none.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch<P> {
    /// Of the rows that were kept.
    pub points: Vec<P>,
    /// Which rows were kept; empty if all were.
    pub kept: Vec<bool>,
    /// Of all rows; empty without such a column.
    pub densities: Vec<f64>,
    /// f / density of a function that is integrated, of all rows; empty without such a column.
    pub weights: Vec<f64>,
}

impl<P> Default for Batch<P> {
    fn default() -> Self {
        Self { points: Vec::new(), kept: Vec::new(), densities: Vec::new(), weights: Vec::new() }
    }
}

impl<P> Batch<P> {
    fn with_capacity(rows: usize, columns: Columns) -> Self {
        let with = |there: bool| Vec::with_capacity(if there { rows } else { 0 });
        Self {
            points: Vec::with_capacity(rows),
            kept: Vec::with_capacity(rows),
            densities: with(columns.density),
            weights: with(columns.weight),
        }
    }

    /// One more row. A row without a density or weight where others have one has the density NaN, the weight 0.
    #[inline(always)]
    pub fn push(&mut self, row: Row<P>) {
        let before = self.kept.len();
        self.kept.push(row.point.is_some());
        self.points.extend(row.point);
        for (column, number, none) in
            [(&mut self.densities, row.density, f64::NAN), (&mut self.weights, row.weight, 0.0)]
        {
            if number.is_some() || !column.is_empty() {
                column.resize(before, none);
                column.push(number.unwrap_or(none));
            }
        }
    }

    /// Whether there is a point of each row that was kept, and a number of every row in the other columns.
    fn is_whole(&self, rows: usize) -> bool {
        let kept = self.kept.iter().filter(|kept| **kept).count();
        let all = |column: usize| column == 0 || column == rows;
        self.points.len() == if self.kept.is_empty() { rows } else { kept }
            && [self.kept.len(), self.densities.len(), self.weights.len()].into_iter().all(all)
    }

    fn is_kept(&self, row: usize) -> bool {
        self.kept.get(row) != Some(&false)
    }

    /// What there is of the rows that were kept, spread over all.
    fn of_all<T: Clone>(&self, of_kept: Vec<T>, none: &T) -> Vec<T> {
        if self.kept.is_empty() {
            return of_kept;
        }
        let mut of_kept = of_kept.into_iter();
        let of_row = |kept: &bool| if *kept { of_kept.next() } else { None };
        self.kept.iter().map(of_row).map(|one| one.unwrap_or_else(|| none.clone())).collect()
    }
}

/// Appends what some rows say, at once: a call for each would cost as much as all else.
type RowsOf<'a, P> = Box<dyn Fn(Piece<'_>, &mut Batch<P>) + Send + Sync + 'a>;

/// Samples that are being read, and what they are held against.
pub struct Recording<'a, D: Domain> {
    domain: D,
    rows_of: RowsOf<'a, D::Point>,
    width: usize,
    columns: Columns,
    density: Option<Judge<'a, D::Point>>,
    cell_mass: Option<Box<dyn Fn(&Cell) -> Option<f64> + Send + Sync + 'a>>,
    positive_over: Option<Box<dyn Fn(&Cell) -> bool + Send + Sync + 'a>>,
    knots: Knots,
    partial: bool,
    integral: Option<f64>,
    name: String,
    pilots: Vec<f64>,
    rows: Option<u64>,
    source: Mutex<Source<'a>>,
    /// Rows that are being judged.
    held: RwLock<Blocks>,
}

/// Which columns there are beside those of the point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Columns {
    density: bool,
    weight: bool,
}

struct Source<'a> {
    rows: Box<dyn Rows + 'a>,
    /// Read, but not judged yet.
    ahead: Vec<Block>,
    error: Option<RowsError>,
}

impl Source<'_> {
    /// The next rows, at most so many; none at the end or where there is an error.
    fn block(&mut self, most: usize) -> Option<Block> {
        if self.error.is_some() || most == 0 {
            return None;
        }
        let mut block = Block::default();
        self.error = self.rows.block(most, &mut block).err();
        (!block.is_empty()).then_some(block)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Begins to judge samples that somebody else drew on `domain`: `row` says what each row of numbers means. They must be independent.
///
/// Without a [`density`](Recording::density) they are only held against the densities that come with them, by the means of 1 / density over cells; without these either,
/// only the mean of the weights is judged, if its [`integral`](Recording::integral) is known.
///
/// ```
/// use warpcheck::domain::Interval;
/// use warpcheck::verify::{Row, Rows, RowsError, Settings, Verdict, Report, recording};
///
/// /// Van der Corput's sequence would be better than chance; these are random.
/// struct Drawn(std::vec::IntoIter<f64>);
/// impl Rows for Drawn {
///     fn width(&self) -> usize { 1 }
///     fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
///         let before = out.len();
///         out.extend(self.0.by_ref().take(most));
///         Ok(out.len() - before)
///     }
/// }
/// let mut rng = warpcheck::random::stream(1, "drawn", 0);
/// let drawn: Vec<f64> = (0..50_000).map(|_| warpcheck::random::unit_f64(&mut rng).sqrt()).collect();
/// let rows = Drawn(drawn.into_iter());
/// let row = |numbers: &[f64]| Row { point: Some(numbers[0]), density: None, weight: None };
/// let settings = Settings::default();
/// let examination = recording(Interval::new(0.0, 1.0), rows, row)?.density(|x| 2.0 * x).name("sqrt").examine(&settings)?;
/// assert_eq!(Report::new(vec![examination], &settings).verdict(), Verdict::Pass);
/// # Ok::<(), RowsError>(())
/// ```
///
/// # Errors
/// Where the first rows can't be read, or there are none.
pub fn recording<'a, D: Domain>(
    domain: D,
    rows: impl Rows + 'a,
    row: impl Fn(&[f64]) -> Row<D::Point> + Send + Sync + 'a,
) -> Result<Recording<'a, D>, RowsError> {
    let width = rows.width();
    recording_of_batches(domain, rows, move |numbers, out| {
        numbers.chunks_exact(width).for_each(|numbers| out.push(row(numbers)));
    })
}

/// The same of many rows at once: `batch` appends what all rows of a block of numbers mean, which costs less than to be asked of each.
///
/// ```
/// # use warpcheck::verify::{Rows, RowsError};
/// # struct Drawn(std::vec::IntoIter<f64>);
/// # impl Rows for Drawn {
/// #     fn width(&self) -> usize { 1 }
/// #     fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
/// #         let before = out.len();
/// #         out.extend(self.0.by_ref().take(most));
/// #         Ok(out.len() - before)
/// #     }
/// # }
/// use warpcheck::domain::{Interval, Knots, Location};
/// use warpcheck::verify::{Report, Settings, Verdict, recording_of_batches};
///
/// // Angles in degrees, of which three in four are below 45.
/// let mut rng = warpcheck::random::stream(1, "batches", 0);
/// let mut angle = || 45.0 * warpcheck::random::unit_f64(&mut rng) + if warpcheck::random::unit_f64(&mut rng) < 0.75 { 0.0 } else { 45.0 };
/// let drawn: Vec<f64> = (0..50_000).map(|_| angle()).collect();
/// let record = recording_of_batches(Interval::new(0.0, 90.0), Drawn(drawn.into_iter()), |degrees, out| {
///     out.points.extend_from_slice(degrees)
/// })?
/// .knots(Knots { axes: [vec![0.5], vec![]] })
/// .density_of_places(|places: &[Location], out| {
///     out.extend(places.iter().map(|place| if place.at[0] < 0.5 { 0.75 / 45.0 } else { 0.25 / 45.0 }))
/// })
/// .positive_over(|_| true);
/// let settings = Settings::default();
/// assert_eq!(Report::new(vec![record.examine(&settings)?], &settings).verdict(), Verdict::Pass);
/// # Ok::<(), RowsError>(())
/// ```
///
/// # Errors
/// As [`recording`].
pub fn recording_of_batches<'a, D: Domain>(
    domain: D,
    rows: impl Rows + 'a,
    batch: impl Fn(&[f64], &mut Batch<D::Point>) + Send + Sync + 'a,
) -> Result<Recording<'a, D>, RowsError> {
    recording_of_pieces(domain, rows, move |piece, out| batch(&piece.numbers(), out))
}

/// The same of rows as they were read, for who can do without `f64` numbers of all.
///
/// # Errors
/// As [`recording`].
pub fn recording_of_pieces<'a, D: Domain>(
    domain: D,
    rows: impl Rows + 'a,
    batch: impl Fn(Piece<'_>, &mut Batch<D::Point>) + Send + Sync + 'a,
) -> Result<Recording<'a, D>, RowsError> {
    let opened = Opened::new(Box::new(rows))?;
    let mut pilots = Batch::default();
    batch(Piece::Numbers(&opened.pilots), &mut pilots);
    let rows = opened.pilots.len() / opened.width;
    if !pilots.is_whole(rows) {
        return Err(format!(
            "of {rows} rows {} points, {} densities and {} weights were made, and {} said to be kept or not: each column needs a number of every row",
            pilots.points.len(),
            pilots.densities.len(),
            pilots.weights.len(),
            pilots.kept.len()
        )
        .into());
    }
    let columns = Columns { density: !pilots.densities.is_empty(), weight: !pilots.weights.is_empty() };
    Ok(Recording::of(domain, opened, columns, Box::new(batch)))
}

/// Rows of which the first are read.
struct Opened<'a> {
    width: usize,
    pilots: Vec<f64>,
    /// How many there are, where that is known.
    count: Option<u64>,
    source: Source<'a>,
}

impl<'a> Opened<'a> {
    fn new(mut rows: Box<dyn Rows + 'a>) -> Result<Self, RowsError> {
        let (width, mut head) = (rows.width(), Vec::new());
        let mut known = rows.count();
        let wanted = known.map_or(PILOTS[0], |n| (n / PILOTS_SHARE).clamp(PILOTS[0], PILOTS[1]));
        // As many rows as make sure that there are enough for pilots, or that there are few.
        let most = wanted.max(PILOTS[0] * FEW_PILOTS_SHARE) as usize;
        while head.len() < most * width {
            if rows.read(most - head.len() / width, &mut head)? == 0 {
                known = Some((head.len() / width) as u64);
                break;
            }
        }
        let there = (head.len() / width) as u64;
        if there == 0 {
            return Err("there are no samples: not a single row".into());
        }
        let is_few = there < most as u64;
        let pilots = if is_few { wanted.min((there / FEW_PILOTS_SHARE).max(1)) } else { wanted } as usize;
        let ahead = vec![Block::Numbers(head.split_off(pilots * width))];
        Ok(Self { width, pilots: head, count: known, source: Source { rows, ahead, error: None } })
    }
}

impl<'a, D: Domain> Recording<'a, D> {
    fn of(domain: D, opened: Opened<'a>, columns: Columns, rows_of: RowsOf<'a, D::Point>) -> Self {
        Self {
            columns,
            domain,
            rows_of,
            width: opened.width,
            density: None,
            cell_mass: None,
            positive_over: None,
            knots: Knots::default(),
            partial: false,
            integral: None,
            name: "samples".to_owned(),
            pilots: opened.pilots,
            rows: opened.count,
            source: Mutex::new(opened.source),
            held: RwLock::new(Blocks::new(opened.width)),
        }
    }

    /// What the report calls them.
    pub fn name(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// The density that they should have, per the domain's measure.
    pub fn density(self, density: impl Fn(&D::Point) -> f64 + Send + Sync + 'a) -> Self {
        Self { density: Some(Judge::Point(Box::new(density))), ..self }
    }

    /// The same of many places on the domain's chart, which are known anyway, in their order and appended to the vector: for densities that would
    /// have to find them from the point, and where asking for many is cheaper.
    pub fn density_of_places(self, density: impl Fn(&[Location], &mut Vec<f64>) + Send + Sync + 'a) -> Self {
        Self { density: Some(Judge::Places(Box::new(density))), ..self }
    }

    /// The probability of a cell, where it is known exactly.
    pub fn cell_mass(self, mass: impl Fn(&Cell) -> Option<f64> + Send + Sync + 'a) -> Self {
        Self { cell_mass: Some(Box::new(mass)), ..self }
    }

    /// Whether the density is known to be positive all over a cell. Then, after the first 65,536 samples, perhaps only each 64th in it is asked for its density: means of
    /// 1 / density are of those that are.
    pub fn positive_over(self, is_positive: impl Fn(&Cell) -> bool + Send + Sync + 'a) -> Self {
        Self { positive_over: Some(Box::new(is_positive)), ..self }
    }

    /// Where the density may jump, along the axes of the domain's chart.
    pub fn knots(self, knots: Knots) -> Self {
        Self { knots, ..self }
    }

    /// The density may be 0 over parts of the domain that nobody names. Then a mean of 1 / density below a cell's measure says nothing.
    pub fn partial(self, partial: bool) -> Self {
        Self { partial, ..self }
    }

    /// The integral that the mean of the weights must be.
    pub fn integral(self, integral: Option<f64>) -> Self {
        Self { integral, ..self }
    }

    /// Runs the checks that can be made on samples alone.
    ///
    /// # Errors
    /// Where a row can't be read.
    pub fn examine(&self, settings: &Settings) -> Result<Examination, RowsError> {
        let left = self.rows.map(|rows| rows - self.pilot_count());
        let settings =
            Settings { samples: settings.samples.min(left.unwrap_or(settings.samples)), ..settings.clone() };
        let mut examination = examine(self, self.name.clone(), &settings);
        examination.against = if self.density.is_some() { Against::Given } else { Against::OwnDensities };
        self.error().map_or(Ok(examination), Err)
    }

    fn error(&self) -> Option<RowsError> {
        lock(&self.source).error.take()
    }

    fn pilot_count(&self) -> u64 {
        (self.pilots.len() / self.width) as u64
    }

    fn held(&self) -> RwLockReadGuard<'_, Blocks> {
        self.held.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends the numbers of a variate's row.
    fn add_numbers(&self, held: &Blocks, xi: f64, out: &mut Vec<f64>) {
        if xi < 1.0 {
            // Below the count, however it is rounded: what is under 1 takes more than half of its last place off it.
            let index = (xi * self.pilot_count() as f64) as usize;
            out.extend_from_slice(&self.pilots[index * self.width..][..self.width]);
        } else {
            held.each_piece(xi as u64 - 1, 1, |piece| piece.append_to(out));
        }
    }

    /// What the row of a variate says: its point, and the density that came with it.
    fn row_of(&self, held: &Blocks, xi: f64) -> Option<(D::Point, Option<f64>)> {
        let mut batch = self.rows_for(held, &[xi]);
        Some((batch.points.pop()?, batch.densities.pop()))
    }

    /// What the rows of variates say.
    fn rows_for(&self, held: &Blocks, xi: &[f64]) -> Batch<D::Point> {
        let mut batch = Batch::with_capacity(xi.len(), self.columns);
        // All pairs are looked at, which is faster than to stop at the first.
        let are_consecutive = || xi.windows(2).fold(true, |all, pair| all & (pair[1] == pair[0] + 1.0));
        if xi.first().is_some_and(|&first| first >= 1.0) && are_consecutive() {
            held.each_piece(xi[0] as u64 - 1, xi.len(), |piece| (self.rows_of)(piece, &mut batch));
        } else {
            let mut numbers = Vec::with_capacity(xi.len() * self.width);
            xi.iter().for_each(|&xi| self.add_numbers(held, xi, &mut numbers));
            (self.rows_of)(Piece::Numbers(&numbers), &mut batch);
        }
        batch
    }

    /// What the column of weights says, if there is one and it is asked for; 0 of what was not kept.
    fn weights_of(&self, batch: &Batch<D::Point>, values: &mut Vec<f64>) {
        if self.integral.is_some() {
            let of_row = |(i, weight): (usize, &f64)| if batch.is_kept(i) { *weight } else { 0.0 };
            values.extend(batch.weights.iter().enumerate().map(of_row));
        }
    }

    /// 0 outside of the domain.
    fn density_of(&self, point: &D::Point) -> f64 {
        match &self.density {
            None => f64::NAN,
            Some(Judge::Point(density)) => density(point),
            Some(Judge::Places(_)) => {
                self.domain.locate(point).map_or(0.0, |place| self.density_there(point, &place))
            }
        }
    }

    /// The same, of a point whose place is known.
    fn density_there(&self, point: &D::Point, place: &Location) -> f64 {
        match &self.density {
            Some(Judge::Places(density)) => {
                let mut one = Vec::with_capacity(1);
                density(std::slice::from_ref(place), &mut one);
                one[0]
            }
            _ => self.density_of(point),
        }
    }
}

impl<D: Domain> Probe for Recording<'_, D> {
    fn space(&self) -> &dyn Space {
        &self.domain
    }

    fn space_for_keeps(&self) -> Box<dyn Space> {
        Box::new(self.domain.clone())
    }

    /// Rows take no variates: numbers stand for them where samplers have those.
    fn dimensions(&self) -> usize {
        0
    }

    fn knots(&self) -> &Knots {
        &self.knots
    }

    fn variate_knots(&self, _: usize) -> Vec<f64> {
        Vec::new()
    }

    fn draw(&self, xi: &[f64], ask: usize, out: &mut Vec<Draw>, values: &mut Vec<f64>) {
        out.clear();
        values.clear();
        let batch = self.rows_for(&self.held(), xi);
        let mut places = Vec::with_capacity(batch.points.len());
        self.domain.locate_many(&batch.points, &mut places);
        let mut places = batch.of_all(places, &None);
        places.resize(xi.len(), None); // what was lost is nowhere
        let fate = |i: usize| if batch.is_kept(i) { Fate::Outside } else { Fate::Rejected };
        let given = self.columns.density;
        out.extend(places.iter().enumerate().map(|(i, place)| match place {
            Some(location) => {
                let density = batch.densities.get(i).filter(|_| given).copied().unwrap_or(f64::NAN);
                Draw { fate: Fate::Drawn, location: *location, density, asked: density }
            }
            None => Draw::without_point(fate(i)),
        }));
        // Asked of all or, where the samples bring their own, of each `ask`-th.
        let step = if given { ask.min(out.len().max(1)) } else { 1 };
        let asked = || out.iter().step_by(step).filter(|draw| draw.fate == Fate::Drawn);
        let mut theirs = Vec::with_capacity(out.len() / step + 1);
        match &self.density {
            None => return self.weights_of(&batch, values),
            Some(Judge::Places(density)) => {
                density(&asked().map(|draw| draw.location).collect::<Vec<_>>(), &mut theirs);
            }
            Some(Judge::Point(density)) => {
                let mut points = batch.points.iter();
                for (i, draw) in out.iter().enumerate() {
                    let point = if batch.is_kept(i) { points.next() } else { None };
                    if draw.fate == Fate::Drawn && i % step == 0 {
                        theirs.extend(point.map(density));
                    }
                }
            }
        }
        let asked = out.iter_mut().step_by(step).filter(|draw| draw.fate == Fate::Drawn);
        for (draw, density) in asked.zip(theirs) {
            draw.asked = density;
            if !given {
                draw.density = density;
            }
        }
        self.weights_of(&batch, values);
    }

    fn locate_roughly(&self, xi: &[f64], out: &mut [Vec<f32>; 2]) -> f32 {
        out.iter_mut().for_each(Vec::clear);
        let batch = self.rows_for(&self.held(), xi);
        let error = self.domain.locate_roughly(&batch.points, out);
        for axis in out {
            *axis = batch.of_all(std::mem::take(axis), &f32::NAN);
            axis.resize(xi.len(), f32::NAN);
        }
        error
    }

    fn is_positive_over(&self, cell: &Cell) -> bool {
        // Where densities come with the samples, each is looked at anyway.
        !self.columns.density && self.positive_over.as_ref().is_some_and(|is_positive| is_positive(cell))
    }

    fn locate(&self, xi: &[f64], out: &mut Vec<Location>) {
        let held = self.held();
        out.extend(xi.iter().filter_map(|&xi| self.domain.locate(&self.row_of(&held, xi)?.0).ok()));
    }

    fn look(&self, xi: &[f64]) -> Option<Look> {
        let (point, density) = self.row_of(&self.held(), xi[0])?;
        let density = density.unwrap_or_else(|| self.density_of(&point));
        let asked = if self.density.is_some() { self.density_of(&point) } else { density };
        Some(Look {
            location: self.domain.locate(&point).map_err(|why| why.0),
            density,
            asked,
            range: [asked; 2],
            point: self.domain.in_words(&point),
        })
    }

    fn density_at(&self, patch: usize, at: [f64; 2]) -> (f64, f64) {
        let (point, jacobian) = self.domain.point(patch, at);
        (self.density_there(&point, &Location { patch, at }), jacobian)
    }

    fn densities_at(&self, places: &[Location], out: &mut Vec<(f64, f64)>) {
        out.clear();
        let Some(Judge::Places(density)) = &self.density else {
            out.extend(places.iter().map(|place| self.density_at(place.patch, place.at)));
            return;
        };
        let mut densities = Vec::with_capacity(places.len());
        density(places, &mut densities);
        let jacobians = places.iter().map(|place| self.domain.point(place.patch, place.at).1);
        out.extend(densities.into_iter().zip(jacobians));
    }

    fn describe(&self, patch: usize, at: [f64; 2]) -> String {
        in_short(&self.domain.point(patch, at).0)
    }

    fn densities_around(&self, xi: &[f64], epsilon: f64) -> Vec<f64> {
        let Some((point, _)) = self.row_of(&self.held(), xi[0]) else { return Vec::new() };
        let neighbours = self.domain.neighbours(&point, epsilon);
        if self.density.is_none() {
            Vec::new()
        } else {
            neighbours.iter().map(|p| self.density_of(p)).collect()
        }
    }

    fn displacements(&self, _: &[f64], _: &[f64]) -> Option<Vec<([f64; 2], f64)>> {
        None
    }

    fn densities_between(&self, _: &[f64], _: &[f64], _: &[f64]) -> Option<Vec<f64>> {
        None
    }

    fn magnitude(&self, _: &[f64]) -> f64 {
        0.0
    }

    fn preimages(&self, _: &[f64]) -> Option<Vec<Preimage>> {
        None
    }

    fn round_trip(&self, _: &[f64]) -> Option<RoundTrip> {
        None
    }

    fn left_over(&self, _: &[f64]) -> Option<f64> {
        None
    }

    fn cell_mass(&self, cell: &Cell) -> Option<f64> {
        self.cell_mass.as_ref().and_then(|mass| mass(cell))
    }

    fn target_at(&self, _: usize, _: [f64; 2]) -> Option<f64> {
        None
    }

    fn importance(&self, _: &[f64]) -> Option<(Vec<f64>, f64)> {
        None
    }

    fn known(&self) -> Vec<(&str, f64)> {
        self.integral
            .filter(|_| self.columns.weight)
            .map(|integral| ("the column of weights", integral))
            .into_iter()
            .collect()
    }

    fn rivals_at(&self, _: usize, _: [f64; 2]) -> Vec<(String, f64)> {
        Vec::new()
    }

    fn called(&self, xi: &[f64]) -> String {
        let row = if xi[0] < 1.0 {
            (xi[0] * self.pilot_count() as f64) as u64
        } else {
            (xi[0] - 1.0) as u64 + self.pilot_count()
        };
        format!("row {row}")
    }

    fn pilots(&self) -> Option<usize> {
        Some(self.pilots.len() / self.width)
    }

    fn load(&self, first: u64, count: u64) -> u64 {
        let mut source = lock(&self.source);
        let mut held = self.held.write().unwrap_or_else(PoisonError::into_inner);
        held.forget_before(first);
        source.ahead.drain(..).for_each(|block| held.push(block));
        let end = first + count;
        while held.end < end
            && let Some(block) = source.block((end - held.end) as usize)
        {
            held.push(block);
        }
        held.end.min(end) - first
    }

    fn load_ahead(&self, count: u64) {
        let mut source = lock(&self.source);
        let mut left = count as usize;
        while let Some(block) = source.block(left) {
            left -= (block.len() / self.width).min(left);
            source.ahead.push(block);
        }
    }

    fn rows_expected(&self, most: u64) -> u64 {
        self.rows.map_or(ASSUMED, |rows| rows - self.pilot_count()).min(most)
    }

    fn has_density(&self) -> bool {
        self.density.is_some()
    }

    fn returns_density(&self) -> bool {
        self.columns.density
    }

    fn partial(&self) -> bool {
        self.partial
    }
}

/// Whether two recordings are of one distribution; judged as [`compare_samples`](super::compare_samples) does, but read as they come.
///
/// # Errors
/// Where a row of either can't be read.
pub fn compare_recordings<D: Domain>(
    first: &Recording<'_, D>,
    second: &Recording<'_, D>,
    settings: &Settings,
) -> Result<Examination, RowsError> {
    let names = [first.name.clone(), second.name.clone()];
    let examination = super::two_sample::examine_recordings([first, second], names, settings);
    first.error().or_else(|| second.error()).map_or(Ok(examination), Err)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Interval;

    struct Few(Vec<f64>);

    impl Rows for Few {
        fn width(&self) -> usize {
            1
        }
        fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
            let read = most.min(self.0.len());
            out.extend(self.0.drain(..read));
            Ok(read)
        }
    }

    /// So many rows of two numbers, so many at once; how many were asked for each time.
    struct Pairs {
        left: usize,
        at_once: usize,
        asked: Vec<usize>,
    }

    impl Rows for Pairs {
        fn width(&self) -> usize {
            2
        }
        fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
            self.asked.push(most);
            let read = most.min(self.at_once).min(self.left);
            self.left -= read;
            out.resize(out.len() + 2 * read, 0.5);
            Ok(read)
        }
    }

    fn pairs(left: usize, at_once: usize) -> Pairs {
        Pairs { left, at_once, asked: vec![] }
    }

    /// Rows are asked for by what is missing, and there are never more of them than that.
    #[test]
    fn rows_of_two_numbers() {
        let read = |mut rows: Pairs| {
            let mut block = Block::default();
            rows.block(10, &mut block).unwrap();
            (block.len(), rows.asked)
        };
        assert_eq!(read(pairs(100, 100)), (20, vec![10]));
        assert_eq!(read(pairs(100, 4)), (20, vec![10, 6, 2]));
        assert_eq!(read(pairs(5, 4)), (10, vec![10, 6, 5]));
        // Those before the first pilot is chosen come in bits as well.
        let opened = Opened::new(Box::new(pairs(150_000, 1000))).unwrap();
        assert_eq!((opened.pilots.len(), opened.count), (2 << 14, None));
        let numbers = |blocks: &[Block]| blocks.iter().map(Block::len).sum::<usize>();
        assert_eq!(numbers(&opened.source.ahead), 2 * (131_072 - (1 << 14)));
        // Nobody knows how many there are, unless told, or there are so few that all have been read.
        assert_eq!(pairs(7, 7).count(), None);
        assert_eq!(Opened::new(Box::new(pairs(80, 7))).unwrap().count, Some(80));
        let row = |numbers: &[f64]| Row { point: Some(numbers[0]), density: None, weight: None };
        let read = recording(Interval::new(0.0, 1.0), pairs(200_000, 1000), row).unwrap();
        let recording: &dyn Probe = &read;
        assert_eq!(recording.load(0, 120_000), 120_000);
        recording.load_ahead(50);
        assert_eq!(numbers(&lock(&read.source).ahead), 100);
        assert_eq!(recording.load(120_000, 80), 80);
    }

    /// So many rows, or as if there were.
    struct Many(u64);

    impl Rows for Many {
        fn width(&self) -> usize {
            1
        }
        fn count(&self) -> Option<u64> {
            Some(self.0)
        }
        fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
            out.resize(out.len() + most, 0.5);
            Ok(most)
        }
    }

    /// One in 64 where it is known how many there are, but 2^14 at least and 2^18 at most.
    #[test]
    fn how_many_rows_are_pilots() {
        let pilots = |count: u64| Opened::new(Box::new(Many(count))).unwrap().pilots.len();
        assert_eq!([1 << 18, 1 << 22, 1 << 30].map(pilots), [1 << 14, 1 << 16, 1 << 18]);
    }

    /// Breaks once and has nothing more, as a pipe of a program that ends.
    struct Breaks(bool);

    impl Rows for Breaks {
        fn width(&self) -> usize {
            1
        }
        fn read(&mut self, _: usize, _: &mut Vec<f64>) -> Result<usize, RowsError> {
            if std::mem::replace(&mut self.0, true) { Ok(0) } else { Err("row is torn".into()) }
        }
    }

    #[test]
    fn errors_are_not_forgotten() {
        let mut source = Source { rows: Box::new(Breaks(false)), ahead: vec![], error: None };
        assert!(source.block(10).is_none() && source.block(10).is_none());
        assert_eq!(source.error.map(|why| why.to_string()).as_deref(), Some("row is torn"));
    }

    /// Where samples bring densities, one of every so many is asked for at the same point.
    #[test]
    fn every_so_many_rows_are_asked() {
        let row = |n: &[f64]| Row { point: Some(n[0]), density: Some(3.0 * n[0]), weight: None };
        // 28 behind four pilots, of which the fifth, 0.25, is left out of the domain.
        let numbers = (0..32).map(|i| if i == 8 { 7.0 } else { f64::from(i) / 32.0 }).collect();
        let read = recording(Interval::new(0.0, 1.0), Few(numbers), row).unwrap().density(|x| 2.0 * x);
        let recording: &dyn Probe = &read;
        assert_eq!(recording.load(0, 28), 28);
        let (mut draws, mut values) = (Vec::new(), Vec::new());
        let xi: Vec<f64> = (1..=28).map(f64::from).collect();
        recording.draw(&xi, 4, &mut draws, &mut values);
        for (i, draw) in draws.iter().enumerate().filter(|(i, _)| *i != 4) {
            let x = (i + 4) as f64 / 32.0;
            let asked = if i % 4 == 0 { 2.0 * x } else { 3.0 * x };
            assert_eq!((draw.fate, draw.density, draw.asked), (Fate::Drawn, 3.0 * x, asked));
        }
        assert_eq!(draws[4].fate, Fate::Outside);
    }

    /// A column has a number of every row, whoever has none; who forgets some is told.
    #[test]
    fn every_row_has_a_number() {
        let mut batch = Batch::default();
        let row = |point: Option<u8>, density: Option<f64>| Row { point, density, weight: density };
        for row in [row(None, None), row(Some(1), Some(2.0)), row(None, None), row(Some(3), Some(4.0))] {
            batch.push(row);
        }
        assert_eq!(
            (batch.points.as_slice(), batch.kept.as_slice()),
            (&[1, 3][..], &[false, true, false, true][..])
        );
        assert!(batch.densities[0].is_nan() && batch.densities[2].is_nan() && batch.densities.len() == 4);
        assert_eq!(
            (batch.densities[1], batch.densities[3], batch.weights.as_slice()),
            (2.0, 4.0, &[0.0, 2.0, 0.0, 4.0][..])
        );
        assert!(batch.is_whole(4) && !batch.is_whole(3));
        assert_eq!(batch.of_all(vec![5, 6], &0), [0, 5, 0, 6]);
        let few = |numbers: &[f64], out: &mut Batch<f64>| {
            out.points.extend(numbers.iter().filter(|x| **x < 0.5));
        };
        let numbers: Vec<f64> = (0..32).map(|i| f64::from(i * 7 % 32) / 32.0).collect();
        let error = recording_of_batches(Interval::new(0.0, 1.0), Few(numbers.clone()), few).err().unwrap();
        assert!(error.to_string().starts_with("of 4 rows 3 points, 0 densities"), "{error}");
        // Those who were rejected have no density either.
        let half = |numbers: &[f64]| {
            let kept = numbers[0] < 0.5;
            Row { point: kept.then_some(numbers[0]), density: kept.then_some(2.0), weight: None }
        };
        let recording = recording(Interval::new(0.0, 1.0), Few(numbers), half).unwrap();
        let recording: &dyn Probe = &recording;
        assert_eq!(recording.load(0, 28), 28);
        let (mut draws, mut values) = (Vec::new(), Vec::new());
        let xi: Vec<f64> = (1..=28).map(f64::from).collect();
        recording.draw(&xi, 1, &mut draws, &mut values);
        assert_eq!(draws.len(), 28);
        for (draw, i) in draws.iter().zip(4..) {
            let x = f64::from(i * 7 % 32) / 32.0;
            assert_eq!(draw.fate, if x < 0.5 { Fate::Drawn } else { Fate::Rejected });
            assert!(draw.fate == Fate::Rejected || (draw.density, draw.location.at[0]) == (2.0, x));
        }
    }

    /// Only densities that came with the samples and are wrong have a ratio to what they should be.
    #[cfg(feature = "foreign")]
    #[test]
    fn ratios_of_wrong_densities() {
        use crate::random::{stream, unit_f64};
        let ratio = |own: f64, given: Option<f64>| {
            let mut rng = stream(7, "ratios", 0);
            let numbers = (0..40_000).map(|_| unit_f64(&mut rng)).collect();
            let row =
                move |numbers: &[f64]| Row { point: Some(numbers[0]), density: Some(own), weight: None };
            let read = recording(Interval::new(0.0, 1.0), Few(numbers), row).unwrap();
            let read = if let Some(given) = given { read.density(move |_| given) } else { read };
            read.examine(&Settings::default()).unwrap().common_ratio
        };
        let (half, _) = ratio(2.0, None).unwrap();
        assert!((half - 0.5).abs() < 0.02, "{half}");
        assert!(ratio(2.0, Some(1.0)).is_none());
        assert!(ratio(1.0, None).is_none());
    }

    /// Rows answer what is asked of samples that are there, and nothing that takes variates.
    #[test]
    fn rows_as_the_checks_see_them() {
        let numbers: Vec<f64> = (0..32).map(|i| f64::from(i) / 32.0).collect();
        let row = |numbers: &[f64]| Row { point: Some(numbers[0]), density: None, weight: None };
        let read = recording(Interval::new(0.0, 1.0), Few(numbers), row).unwrap().density(|x| 2.0 * x);
        let recording: &dyn Probe = &read;
        assert_eq!(
            (recording.pilots(), recording.rows_expected(100), recording.rows_expected(9)),
            (Some(4), 28, 9)
        );
        assert_eq!((recording.load(0, 10), recording.load(10, 30)), (10, 18));
        // Rows by their number plus 1, pilots by their share.
        assert_eq!(
            [0.1, 0.3, 0.9, 11.0, 28.0].map(|xi| recording.called(&[xi])),
            ["row 0", "row 1", "row 3", "row 14", "row 31"]
        );
        let at = |xi: f64| recording.look(&[xi]).unwrap().location.unwrap().at[0] * 32.0;
        assert_eq!([0.1, 0.3, 0.9, 11.0, 28.0].map(at), [0.0, 1.0, 3.0, 14.0, 31.0]);
        let look = recording.look(&[12.0]).unwrap();
        assert_eq!((look.density, look.asked, look.point.as_str()), (30.0 / 32.0, 30.0 / 32.0, "0.469"));
        let (mut draws, mut values) = (Vec::new(), vec![1.0]);
        recording.draw(&[11.0, 12.0, 0.3], 1, &mut draws, &mut values);
        assert_eq!(draws.iter().map(|d| d.location.at[0] * 32.0).collect::<Vec<_>>(), [14.0, 15.0, 1.0]);
        // In any order, and more than once.
        for rows in [[11.0, 12.0, 13.0], [11.0, 15.0, 20.0], [13.0, 12.0, 11.0], [12.0, 12.0, 12.0]] {
            recording.draw(&rows, 1, &mut draws, &mut values);
            let found: Vec<f64> = draws.iter().map(|d| d.location.at[0] * 32.0).collect();
            assert_eq!(found, rows.map(|row| row + 3.0));
        }
        let last = crate::random::ONE_MINUS_EPSILON_F64;
        assert_eq!((at(0.0), at(last), recording.called(&[last]).as_str()), (0.0, 3.0, "row 3"));
        assert_eq!(
            recording.densities_around(&[12.0], 0.25),
            [2.0 * (0.46875 - 0.25), 2.0 * (0.46875 + 0.25)]
        );
        assert_eq!(
            (recording.describe(0, [0.25, 0.0]).as_str(), recording.density_at(0, [0.25, 0.0])),
            ("0.250", (0.5, 1.0))
        );
        assert!(
            recording.variate_knots(0).is_empty()
                && recording.left_over(&[0.5]).is_none()
                && recording.preimages(&[0.5]).is_none()
        );
        assert!(
            recording.displacements(&[0.1], &[0.2]).is_none()
                && recording.densities_between(&[0.1], &[0.2], &[0.5]).is_none()
        );
        assert!(
            recording.round_trip(&[0.1]).is_none()
                && recording.magnitude(&[0.1]) == 0.0
                && recording.importance(&[0.1]).is_none()
        );
        assert!(
            recording.target_at(0, [0.5; 2]).is_none()
                && recording.rivals_at(0, [0.5; 2]).is_empty()
                && recording.cell_mass(&Cell::whole(&Interval::new(0.0, 1.0))).is_none()
        );
        assert!(
            recording.has_density()
                && !recording.returns_density()
                && !recording.partial()
                && !recording.is_slow()
                && recording.known().is_empty()
        );
    }
}
