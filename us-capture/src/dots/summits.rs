//! The summits of an image, each with the level at which it stops being a piece of its own.

use super::floor::{CELL, Floor};

/// No summit was here.
const NONE: u32 = u32::MAX;

/// A summit and the piece of the image that is connected to it from above.
#[derive(Clone, Copy, Debug)]
pub(super) struct Summit {
    /// Its column and row.
    pub at: [usize; 2],
    /// Its grey level.
    pub level: u8,
    /// The highest level at which it is no piece of its own: joined to a higher summit, longer than a dot, or the floor.
    pub base: u8,
    /// The highest level at which it is joined to a lower summit that is a dot of its own (or the base).
    pub saddle: u8,
    /// The floor under it.
    pub floor: u8,
    ended: bool,
    first: [u16; 2],
    last: [u16; 2],
}

/// The tree of all thresholds of an image, pixel by pixel from the brightest down.
pub(super) struct Summits {
    width: usize,
    longest: [f64; 2],
    prominence: f64,
    /// The pixels above the floor, and how many have each grey level.
    above: Vec<u32>,
    counts: [u32; 257],
    sorted: Vec<u32>,
    /// Which summit a pixel belongs to; the lower number is the higher summit.
    owner: Vec<u32>,
    parent: Vec<u32>,
    found: Vec<Summit>,
}

impl Summits {
    pub(super) fn new(width: usize, height: usize, longest: [f64; 2], prominence: f64) -> Self {
        Self {
            width,
            longest,
            prominence,
            above: Vec::new(),
            counts: [0; 257],
            sorted: Vec::new(),
            owner: vec![NONE; width * height],
            parent: Vec::new(),
            found: Vec::new(),
        }
    }

    /// The summits that stand out as a dot does.
    pub(super) fn find(
        &mut self,
        image: &[u8],
        inside: &[u8],
        floor: &Floor,
    ) -> impl Iterator<Item = &Summit> {
        self.collect(image, inside, floor);
        self.sort(image);
        self.parent.clear();
        self.found.clear();
        for index in 0..self.sorted.len() {
            let pixel = self.sorted[index] as usize;
            self.add(pixel, image[pixel], floor);
        }
        for pixel in &self.sorted {
            self.owner[*pixel as usize] = NONE;
        }
        let prominence = self.prominence;
        self.found.iter().filter(move |summit| summit.stands_out(summit.base, prominence))
    }

    /// The pixels above the floor.
    fn collect(&mut self, image: &[u8], inside: &[u8], floor: &Floor) {
        self.above.clear();
        self.counts.fill(0);
        for (row, pixels) in image.chunks_exact(self.width).enumerate() {
            for (cell, chunk) in pixels.chunks(CELL).enumerate() {
                let level = floor.cell(cell, row / CELL);
                if chunk.iter().fold(false, |any, p| any | (*p > level)) {
                    self.collect_cell(chunk, row * self.width + cell * CELL, inside, level);
                }
            }
        }
    }

    fn collect_cell(&mut self, chunk: &[u8], first: usize, inside: &[u8], level: u8) {
        for (pixel, p) in (first..).zip(chunk) {
            if *p > level && inside[pixel] != 0 {
                self.above.push(pixel as u32);
                self.counts[255 - usize::from(*p)] += 1;
            }
        }
    }

    /// From the brightest down, in the image's order among equals.
    fn sort(&mut self, image: &[u8]) {
        let mut first = 0;
        for count in &mut self.counts {
            first += std::mem::replace(count, first);
        }
        self.sorted.clear();
        self.sorted.resize(self.above.len(), 0);
        for pixel in &self.above {
            let next = &mut self.counts[255 - usize::from(image[*pixel as usize])];
            self.sorted[*next as usize] = *pixel;
            *next += 1;
        }
    }

    fn add(&mut self, pixel: usize, level: u8, floor: &Floor) {
        let at = [pixel % self.width, pixel / self.width];
        let mut highest = NONE;
        for near in neighbours(at, self.width, self.owner.len() / self.width).into_iter().flatten() {
            let owner = self.owner[near];
            if owner == NONE || owner == highest {
                continue;
            }
            let owner = self.root(owner);
            if highest == NONE {
                highest = owner;
            } else if owner != highest {
                let (high, low) = (highest.min(owner), highest.max(owner));
                self.join(high, low, level);
                highest = high;
            }
        }
        if highest == NONE {
            highest = self.begin(at, level, floor.at(at[0], at[1]));
        }
        self.owner[pixel] = highest;
        self.grow(highest, at.map(|x| x as u16), at.map(|x| x as u16), level);
    }

    fn begin(&mut self, at: [usize; 2], level: u8, floor: u8) -> u32 {
        let (first, last) = (at.map(|x| x as u16), at.map(|x| x as u16));
        let base = floor.min(level);
        self.found.push(Summit { at, level, base, saddle: base, floor: base, ended: false, first, last });
        let number = self.parent.len() as u32;
        self.parent.push(number);
        number
    }

    fn root(&mut self, mut summit: u32) -> u32 {
        while self.parent[summit as usize] != summit {
            let above = self.parent[self.parent[summit as usize] as usize];
            self.parent[summit as usize] = above;
            summit = above;
        }
        summit
    }

    /// The lower summit drowns in the higher one.
    fn join(&mut self, high: u32, low: u32, level: u8) {
        self.parent[low as usize] = high;
        let drowned = &mut self.found[low as usize];
        let of_its_own = if drowned.ended { drowned.base } else { level };
        drowned.end(level);
        let (first, last, dot) =
            (drowned.first, drowned.last, drowned.stands_out(of_its_own, self.prominence));
        let summit = &mut self.found[high as usize];
        if dot {
            summit.saddle = summit.saddle.max(level);
        }
        self.grow(high, first, last, level);
    }

    /// The piece under a summit takes in what lies between `first` and `last`.
    fn grow(&mut self, summit: u32, first: [u16; 2], last: [u16; 2], level: u8) {
        let summit = &mut self.found[summit as usize];
        for axis in 0..2 {
            summit.first[axis] = summit.first[axis].min(first[axis]);
            summit.last[axis] = summit.last[axis].max(last[axis]);
            if f64::from(summit.last[axis] - summit.first[axis]) >= self.longest[axis] {
                summit.end(level);
            }
        }
    }
}

impl Summit {
    const fn end(&mut self, level: u8) {
        if !self.ended {
            self.ended = true;
            self.base = level;
        }
    }

    fn stands_out(&self, base: u8, prominence: f64) -> bool {
        f64::from(self.level - base) >= prominence * f64::from(self.level - self.floor)
            && self.level > self.floor
    }
}

fn neighbours([column, row]: [usize; 2], width: usize, height: usize) -> [Option<usize>; 8] {
    let (left, right) = (column > 0, column + 1 < width);
    let (up, down) = (row > 0, row + 1 < height);
    let at = row * width + column;
    let when = |there: bool, at: usize| there.then_some(at);
    [
        when(left, at.wrapping_sub(1)),
        when(right, at + 1),
        when(up, at.wrapping_sub(width)),
        when(down, at + width),
        when(up && left, at.wrapping_sub(width + 1)),
        when(up && right, at.wrapping_sub(width).wrapping_add(1)),
        when(down && left, (at + width).wrapping_sub(1)),
        when(down && right, at + width + 1),
    ]
}
