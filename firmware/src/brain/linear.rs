//! The guarded solution of a small square system, for the inverses of Eq. 11.

use nalgebra::{SMatrix, SVector};

use crate::scalar::Scalar;

/// `a⁻¹ b` by Gaussian elimination with partial pivoting; `a` is `K × K` and `b` has `K` entries.
///
/// A pivot below `pivot_floor` in magnitude is replaced by the floor with the pivot's sign, so a
/// singular `a` gives a large solution, not a division by zero: the clip of ζ then bounds it. The
/// floor is never less than the scalar's smallest positive value. Partial pivoting has found the
/// largest candidate before the floor is applied, hence a floored pivot means that the rest of the
/// column vanishes too.
///
/// The rows are brought into order by comparing each with the pivot row and exchanging the two at
/// once. This finds the same pivot as a search would and every index is a loop's own, so no bounds
/// check, and no panic, is left in the compiled code.
#[inline]
// The indices are the mathematics here, and iterators over two rows of one array would need a split.
#[allow(clippy::needless_range_loop)]
pub fn solve<W: Scalar, const K: usize>(a: &SMatrix<W, K, K>, b: &SVector<W, K>, pivot_floor: W) -> SVector<W, K> {
    let floor = pivot_floor.at_least(W::SMALLEST);
    // Row by row, since elimination works on rows; nalgebra stores columns.
    let mut a = a.transpose().data.0;
    let [mut b] = b.data.0;
    for k in 0..K {
        for row in k + 1..K {
            if a[row][k].abs() > a[k][k].abs() {
                a.swap(k, row);
                b.swap(k, row);
            }
        }
        if a[k][k].abs() < floor {
            a[k][k] = if a[k][k] < W::zero() { -floor } else { floor };
        }
        for row in k + 1..K {
            let factor = a[row][k] / a[k][k];
            for column in k + 1..K {
                a[row][column] -= factor * a[k][column];
            }
            b[row] -= factor * b[k];
        }
    }
    for k in (0..K).rev() {
        for column in k + 1..K {
            b[k] -= a[k][column] * b[column];
        }
        b[k] /= a[k][k];
    }
    SVector::from_array_storage(nalgebra::ArrayStorage([b]))
}
