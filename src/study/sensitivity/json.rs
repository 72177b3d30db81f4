//! A study as JSON, SI. What is not finite is `null`.

use super::blocks::Estimate;
use super::result::{Chosen, Identification, Index, Information, QUANTILES, Sensitivity};
use serde_json::{Value, json};

fn number(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn numbers(values: &[f64]) -> Value {
    values.iter().map(|x| number(*x)).collect()
}

fn matrix(rows: &[Vec<f64>]) -> Value {
    rows.iter().map(|row| numbers(row)).collect()
}

impl Sensitivity {
    /// Everything but the terms of polynomials.
    pub fn to_json(&self) -> Value {
        let [nominal, low, least] = self.margins;
        let laws = |inputs: &[(String, &str, String)]| -> Value {
            inputs.iter().map(|(name, unit, law)| json!({ "name": name, "unit": unit, "law": law })).collect()
        };
        json!({
            "method": self.method,
            "rows": self.rows,
            "usable": self.usable,
            "confidence": self.confidence,
            "inputs": laws(&self.inputs),
            "uncertain": laws(&self.uncertain),
            "indices": self.indices.iter().map(index).collect::<Value>(),
            "slopes": self.slopes_json(),
            "local": self.local_json(),
            "spreads": self.spreads_json(),
            "margin": { "nominal": number(nominal), "q1": number(low), "least": number(least) },
            "failures": self.failures_json(),
            "polynomials": self.polynomials_json(),
            "convergence": self.convergence_json(),
            "identification": self.identification.as_ref().map_or(Value::Null, identification),
            "notes": self.notes,
            "distrusted": self.mark,
            "checked": self.checked,
        })
    }

    fn slopes_json(&self) -> Value {
        let each = self.slopes.iter().map(|slopes| {
            json!({
                "output": slopes.output, "input": slopes.input, "nu": number(slopes.mean_square),
                "constant": number(slopes.constant), "upper": number(slopes.upper), "mean_slope": number(slopes.mean),
                "sd_slope": number(slopes.deviation), "jump_share": number(slopes.jump_share), "flag": slopes.flag,
            })
        });
        each.collect()
    }

    fn local_json(&self) -> Value {
        let each = self.local.iter().map(|local| {
            json!({
                "output": local.output, "input": local.input, "slope": number(local.slope),
                "per_100_percent": number(local.per_value), "per_standard_deviation": number(local.per_deviation),
                "quantiles_5_50_95": numbers(&local.quantiles),
            })
        });
        each.collect()
    }

    fn spreads_json(&self) -> Value {
        let each = self.spreads.iter().map(|spread| {
            let lumps = |lumps: super::Lumps| json!({ "at": lumps.at, "share_above": lumps.share_above });
            json!({
                "output": spread.output, "unit": spread.unit, "rows": spread.rows, "mean": number(spread.mean),
                "sd": number(spread.deviation), "skew": number(spread.skew), "least": number(spread.least),
                "largest": number(spread.largest), "shares": QUANTILES, "quantiles": numbers(&spread.quantiles),
                "nominal": number(spread.nominal), "sd_first_order": number(spread.first_order),
                "quantiles_first_order": numbers(&spread.first_order_quantiles), "ratio": number(spread.ratio),
                "mean_shift": number(spread.mean_shift), "lumps": spread.lumps.map(lumps), "flag": spread.flag,
            })
        });
        each.collect()
    }

    fn failures_json(&self) -> Value {
        let statuses = self.statuses.iter().map(|share| {
            let interval = numbers(&share.interval);
            json!({ "status": share.status.name(), "rows": share.rows, "share": share.share, "interval": interval })
        });
        let worst = self.worst_cases.iter().map(|worst| {
            let totals: Value = worst.totals.iter().map(|totals| numbers(totals)).collect();
            json!({ "output": worst.output, "totals": totals, "changes_order": worst.changes_order })
        });
        json!({
            "statuses": statuses.collect::<Value>(),
            "indices": self.failure_indices.iter().map(index).collect::<Value>(),
            "worst_cases": worst.collect::<Value>(),
        })
    }

    fn polynomials_json(&self) -> Value {
        let each = self.polynomials.iter().map(|one| {
            json!({
                "output": one.output, "degree": one.degree, "terms": one.coefficients.len(), "rows": one.rows,
                "q2": number(one.predicted),
            })
        });
        each.collect()
    }

    fn convergence_json(&self) -> Value {
        let each = self.convergence.iter().map(|one| {
            let steps: Value = one.steps.iter().map(|(rows, value)| json!([rows, number(*value)])).collect();
            json!({ "output": one.output, "input": one.input, "index": one.order.name(), "steps": steps })
        });
        each.collect()
    }
}

fn index(index: &Index) -> Value {
    let Estimate { value, low, high, .. } = index.estimate;
    json!({
        "output": index.output, "input": index.input, "index": index.order.name(), "estimator": index.estimator,
        "main": index.is_main, "value": number(value), "low": number(low), "high": number(high), "pairs": index.pairs,
        "rows": index.rows, "flag": index.flag,
    })
}

fn identification(found: &Identification) -> Value {
    json!({
        "parameters": found.parameters, "logarithmic": found.logarithmic, "noise": found.noise,
        "tangent_noise": found.tangent_noise,
        "candidates": found.candidates, "minimum_margin": found.minimum_margin, "all": information(&found.all),
        "chosen": found.chosen.as_ref().map_or(Value::Null, chosen),
    })
}

fn chosen(found: &Chosen) -> Value {
    let worst = found.worst.as_ref().map(|(value, end)| json!({ "log_determinant": number(*value), "end": end }));
    json!({
        "samples": found.samples, "margins": numbers(&found.margins), "information": information(&found.information),
        "worst": worst,
    })
}

fn information(found: &Information) -> Value {
    let directions = found.directions.iter().map(|direction| {
        json!({
            "singular_value": number(direction.singular_value), "weights": direction.weights,
            "strength": direction.strength.name(),
        })
    });
    let observability = found.observability;
    json!({
        "fisher": matrix(&found.fisher), "eigenvalues": numbers(&found.eigenvalues),
        "deviations": numbers(&found.deviations), "correlations": matrix(&found.correlations),
        "directions": directions.collect::<Value>(), "findings": found.findings,
        "observability": {
            "volume": number(observability.volume), "roundness": number(observability.roundness),
            "weakest": number(observability.weakest), "amplification": number(observability.amplification),
        },
        "log_determinant": number(found.log_determinant),
    })
}
