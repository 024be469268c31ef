//! Contract of the tiles for matrix units: they are as large as the device's limits allow, and a
//! field that is too wide is refused with the largest width.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

use super::*;
use proptest::{prelude::*, sample::select};

fn limits(bytes: u32, invocations: u32) -> Limits {
    Limits {
        max_compute_workgroup_storage_size: bytes,
        max_compute_invocations_per_workgroup: invocations,
        max_compute_workgroup_size_x: invocations,
        ..Limits::default()
    }
}

fn units(side: usize, largest_subgroup: usize) -> MatrixUnits {
    MatrixUnits {
        side,
        largest_subgroup,
    }
}

/// Checks limits that drivers report, for the field of the published width.
#[test]
fn the_published_field_fits_the_devices_that_have_matrix_units() {
    for (units, limits, lanes) in [
        (units(16, 32), limits(48 << 10, 1024), 64),
        (units(16, 64), limits(64 << 10, 1024), 64),
        (units(8, 64), limits(32 << 10, 1024), 32),
    ] {
        let tiles = Tiles::new(units, 256, &limits).unwrap();
        assert_eq!((tiles.width(), tiles.lanes()), (256, lanes), "{units:?}");
    }
}

proptest! {
    #[test]
    fn tiles_have_the_largest_size_that_fits(
        side in select(vec![8usize, 16]),
        subgroup in select(vec![8usize, 32, 64, 128]),
        kibibytes in select(vec![16u32, 32, 48, 228]),
        invocations in select(vec![256u32, 1024]),
        width in 1usize..1200,
    ) {
        let (units, limits) = (units(side, subgroup), limits(kibibytes << 10, invocations));
        let step = ROWS * side;
        match Tiles::new(units, width, &limits) {
            Ok(tiles) => {
                prop_assert!(tiles.fit(&limits));
                prop_assert!((width..width + step).contains(&tiles.width()));
                let larger = Tiles { columns: 2 * tiles.columns, ..tiles };
                prop_assert!(tiles.columns == MAX_COLUMNS || !larger.fit(&limits));
            }
            Err(GpuError::TooLarge { limit, found, .. }) => {
                prop_assert!((width..width + step).contains(&found) && limit < width);
                if limit > 0 {
                    prop_assert_eq!(Tiles::new(units, limit, &limits).unwrap().width(), limit);
                }
                prop_assert!(Tiles::new(units, limit + 1, &limits).is_err());
            }
            Err(other) => return Err(TestCaseError::fail(other.to_string())),
        }
    }
}
