//! What the machine writes over its picture: digits, marks of depth, a bar.

use probepath_us_capture::Setting;

use super::config::Overlay;
use super::settings::{COLUMNS, ROWS};

/// Grey level of digits, marks and bar.
const WHITE: u8 = 255;
/// Digits of 3 x 5 dots, row after row, the top one in the highest bits.
const DIGITS: [u16; 10] = [
    0b111_101_101_101_111,
    0b010_110_010_010_111,
    0b111_001_111_100_111,
    0b111_001_111_001_111,
    0b101_101_111_001_001,
    0b111_100_111_001_111,
    0b111_100_111_101_111,
    0b111_001_010_010_010,
    0b111_101_111_101_111,
    0b111_101_111_001_111,
];
/// Pixels along a dot's edge.
const DOT: usize = 2;
/// Where the number begins: column and row.
const TEXT_AT: [usize; 2] = [8, 24];
/// Distance between two marks of depth (m).
const MARK_M: f64 = 5e-3;

/// Writes it.
pub(super) fn write(pixels: &mut [u8], overlay: &Overlay, setting: &Setting, number: u64) {
    if let Some(bar) = pixels.get_mut(..overlay.bar_rows.min(ROWS) * COLUMNS) {
        bar.fill(WHITE);
    }
    if overlay.text {
        text(pixels, number);
    }
    if overlay.ruler {
        ruler(pixels, setting);
    }
}

fn text(pixels: &mut [u8], number: u64) {
    for (place, digit) in format!("{number:04}").bytes().enumerate() {
        let dots = DIGITS.get(usize::from(digit - b'0')).copied().unwrap_or(0);
        for dot in 0..15 {
            if dots >> (14 - dot) & 1 == 1 {
                let column = TEXT_AT[0] + (place * 4 + dot % 3) * DOT;
                square(pixels, column, TEXT_AT[1] + dot / 3 * DOT, [DOT, DOT]);
            }
        }
    }
}

/// A mark every 5 mm of depth under the face, a longer one every 10 mm.
fn ruler(pixels: &mut [u8], setting: &Setting) {
    let first = (setting.window_top_m / MARK_M).ceil() as usize;
    let last = ((setting.window_top_m + setting.window_height_m) / MARK_M).floor() as usize;
    for mark in first..=last {
        let row = (mark as f64 * MARK_M - setting.window_top_m) / setting.spacing.y_m;
        let long = if mark % 2 == 0 { 8 } else { 4 };
        square(pixels, COLUMNS - long - 2, row as usize, [long, 2]);
    }
}

fn square(pixels: &mut [u8], column: usize, row: usize, [width, height]: [usize; 2]) {
    for row in row..(row + height).min(ROWS) {
        let from = row * COLUMNS + column.min(COLUMNS);
        let to = row * COLUMNS + (column + width).min(COLUMNS);
        if let Some(line) = pixels.get_mut(from..to) {
            line.fill(WHITE);
        }
    }
}
