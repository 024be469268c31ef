//! Places of the panes.

/// Gap between panes, pixels or points.
const GAP: f32 = 4.0;
/// Width by height of a pane in which a person stands well.
const BEST_ASPECT: f32 = 0.72;

/// Place of a pane: left, top, width and height.
pub(super) type Cell = [f32; 4];

/// Divides a region of `size` (width, height) into cells of one size for `count` panes, in rows.
///
/// The number of columns is the one that gives cells nearest to a standing person's aspect.
pub(super) fn cells(count: usize, size: [f32; 2]) -> Vec<Cell> {
    let count = count.max(1);
    let cell = |columns: usize| {
        let rows = count.div_ceil(columns);
        let side = |whole: f32, parts: usize| (whole - GAP * (parts - 1) as f32) / parts as f32;
        [side(size[0], columns).max(1.0), side(size[1], rows).max(1.0)]
    };
    // Size of a person in a cell: a wide or a high cell shows no larger one.
    let person = |columns: &usize| {
        let [width, height] = cell(*columns);
        (width / BEST_ASPECT).min(height)
    };
    let columns = (1..=count).max_by(|a, b| {
        // More columns win between equals: rows divide what stands.
        person(a).total_cmp(&person(b)).then(a.cmp(b))
    });
    let columns = columns.unwrap_or(count);
    let [width, height] = cell(columns);
    let place = |i: usize| {
        let (column, row) = ((i % columns) as f32, (i / columns) as f32);
        [column * (width + GAP), row * (height + GAP), width, height]
    };
    (0..count).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panes_stand_side_by_side_in_a_wide_region_and_above_each_other_in_a_high_one() {
        let wide = cells(3, [1208.0, 600.0]);
        assert_eq!(wide[1], [404.0, 0.0, 400.0, 600.0]);
        let high = cells(2, [300.0, 1004.0]);
        assert_eq!(high[1], [0.0, 504.0, 300.0, 500.0]);
        let six = cells(6, [1208.0, 1004.0]);
        assert_eq!((six.len(), six[3]), (6, [0.0, 504.0, 400.0, 500.0]));
    }

    #[test]
    fn no_panes_and_no_room_have_cells_all_the_same() {
        assert_eq!(cells(0, [10.0, 10.0]), [[0.0, 0.0, 10.0, 10.0]]);
        assert!(cells(5, [0.0, 0.0]).iter().all(|cell| cell[2] >= 1.0));
    }
}
