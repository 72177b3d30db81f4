// Equilibria off the path: Newton's method under the full load from a given base moment. R4
// crates/core/src/cpu/equilibrium/search.rs

//@if SEARCH
const SEARCH_LIMIT: f32 = 0.0; //@spec
const SEARCH_STEP: f32 = 0.0; //@spec
const MOST_KNOWN: u32 = 1u; //@spec

// The equilibrium that the sample comes to from its start, away from known ones.
fn search(rod: Rod) -> PathEnd {
    var end: PathEnd;
    end.path = SEARCH;
    end.history.lambda = 1.0;
    end.m0 = start_moment();
    loop {
        columns[BY_MOMENT] = moment_columns();
        let tip = shoot(COARSE, rod, 1.0, end.m0, PATH_COLUMNS, false);
        end.inverse = inverse(tip_moment_columns(tip, BY_MOMENT));
        let newton = -(end.inverse * (tip.m - rod.l_tip)); // R4
        let delta = newton * deflation(end.m0, newton);
        let size = length(delta);
        end.reached = size < PATH_TOLERANCE * (1.0 + length(end.m0));
        // A start that is as good as this grid can tell stays for the fine grid.
        let moves = !end.reached || end.passes >= 1.0;
        if moves { end.m0 = end.m0 + delta * select(SEARCH_STEP / size, 1.0, size < SEARCH_STEP); }
        end.passes = end.passes + 1.0;
        if end.reached || end.passes >= SEARCH_LIMIT || !is_finite(size) { break; }
    }
    return end;
}

// What becomes of Newton's step if the residual is multiplied by 1 + 1/d^2 for each known equilibrium at distance d.
fn deflation(m0: vec3<f32>, newton: vec3<f32>) -> f32 {
    var slope = 0.0;
    for (var k = 0u; k < MOST_KNOWN; k++) { //@unroll
        let away = m0 - known_moment_k();
        let d2 = dot(away, away);
        slope = slope - dot(away, newton) * 2.0 / (d2 * (1.0 + d2));
    } //@end
    return 1.0 / (1.0 - slope);
}
//@end
