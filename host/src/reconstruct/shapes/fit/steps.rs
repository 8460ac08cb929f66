//! The steps of Gauss-Newton: how many there are, and the equations of each.

/// Steps; each halves what is wrong at the very least, most do far better.
pub(crate) const STEPS: usize = 8;
/// The first so many steps ask points farther off.
pub(crate) const WIDE_STEPS: usize = 3;

/// Solves equations by elimination with pivots.
pub(crate) fn solve<const N: usize>(mut m: [[f64; N]; N], mut b: [f64; N]) -> Option<[f64; N]> {
    for column in 0..N {
        let pivot = (column..N).max_by(|i, j| m[*i][column].abs().total_cmp(&m[*j][column].abs()))?;
        if m[pivot][column].abs() < 1e-9 {
            return None;
        }
        m.swap(column, pivot);
        b.swap(column, pivot);
        for row in column + 1..N {
            let share = m[row][column] / m[column][column];
            let above = m[column];
            m[row].iter_mut().zip(above).for_each(|(v, a)| *v -= share * a);
            b[row] -= share * b[column];
        }
    }
    for row in (0..N).rev() {
        let known: f64 = (row + 1..N).map(|k| m[row][k] * b[k]).sum();
        b[row] = (b[row] - known) / m[row][row];
    }
    Some(b)
}
