//! The Runge-Kutta methods of a plan, as terms and constants of the shaders.

use super::specialise::{Specialisation, Value};
use crate::model::tolerances::PATH_STEPPER;
use crate::model::{Plan, Tableau};

/// The tableaux in use: that of the path, that of the answer.
///
/// By nodes the path's method gives the answer, too: in f32 one of order eight gains nothing. In a field that varies that of
/// the answer leads there: compilers take long over the code of a pass.
pub(super) fn tableaux(plan: &Plan, by_nodes: bool) -> Vec<&'static Tableau> {
    let answer = if by_nodes { PATH_STEPPER } else { plan.options.stepper };
    if answer == PATH_STEPPER || plan.terms.varying_field {
        vec![answer.tableau()]
    } else {
        vec![PATH_STEPPER.tableau(), answer.tableau()]
    }
}

/// Coefficients, padded to one number of stages, and which of them are not zero.
pub(super) fn add_tableaux(s: &mut Specialisation, tableaux: &[&'static Tableau]) {
    let stages = tableaux.iter().map(|tableau| tableau.b.len()).max().unwrap_or(0);
    let padded = |row: &[f64]| Value::float_array((0..stages).map(|j| row.get(j).copied().unwrap_or(0.0)));
    let row = |tableau: &Tableau, i: usize| padded(tableau.a.get(i).copied().unwrap_or(&[]));
    let matrix = |tableau: &&Tableau| Value::Array((0..stages).map(|i| row(tableau, i)).collect());
    s.constant("TABLEAU_COUNT", Value::U32(tableaux.len() as u32));
    s.constant("STAGES", Value::U32(stages as u32));
    s.constant("A", Value::Array(tableaux.iter().map(matrix).collect()));
    s.constant("B", Value::Array(tableaux.iter().map(|tableau| padded(tableau.b)).collect()));
    s.constant("C", Value::Array(tableaux.iter().map(|tableau| padded(tableau.c)).collect()));
    for (r, tableau) in tableaux.iter().enumerate() {
        s.constant(format!("STAGE_COUNT_{r}"), Value::U32(tableau.b.len() as u32));
        for (i, row) in tableau.a.iter().enumerate() {
            s.term(format!("B[{r}][{i}]"), tableau.b[i] != 0.0);
            for (j, a) in row.iter().enumerate() {
                s.term(format!("A[{r}][{i}][{j}]"), *a != 0.0);
            }
        }
    }
}
