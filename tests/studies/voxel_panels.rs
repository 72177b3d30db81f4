//! Planes of voxels lie where they should, and bars of errors end where they should.

use rodsweep::draw::{
    AxisLabel, Colour, ColourScale, Curves, Figure, ImageFormat, Marker, ReportError, Series, VoxelEdge, VoxelPanel,
    VoxelRows, VoxelSheet, encode,
};

const VIOLET: [u8; 3] = [0x44, 0x01, 0x54];
const YELLOW: [u8; 3] = [0xfd, 0xe7, 0x25];
const GREY: [u8; 3] = [0xcf, 0xcf, 0xcf];

fn panel(columns: usize, squares: &[Option<f64>]) -> VoxelPanel {
    VoxelPanel {
        title: "slice".into(),
        axes: ["x", "z"].map(str::to_owned),
        corner: [-0.01, 0.02],
        spacing: 0.01,
        columns,
        squares: squares.to_vec(),
        edges: Vec::new(),
        plane: None,
    }
}

fn sheet(panel: VoxelPanel, scale: ColourScale) -> VoxelSheet {
    let rows = VoxelRows { quantity: "margin".into(), scale, rows: vec![vec![panel]], ..VoxelRows::default() };
    VoxelSheet { groups: vec![rows], ..VoxelSheet::default() }
}

/// How many pixels of the panel have a colour, and their mean place (column, row). The colour bar does not count.
fn pixels(sheet: &VoxelSheet, colour: [u8; 3]) -> (usize, [f64; 2]) {
    let bytes = encode(sheet, ImageFormat::Png).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let width = reader.next_frame(&mut pixels).unwrap().width as usize;
    let places = pixels.chunks_exact(3).enumerate().filter(|(_, pixel)| *pixel == colour);
    let places: Vec<[f64; 2]> = places
        .map(|(k, _)| [(k % width) as f64, (k / width) as f64])
        .filter(|[x, _]| *x < 0.87 * width as f64)
        .collect();
    let mean = |k: usize| places.iter().map(|place| place[k]).sum::<f64>() / places.len() as f64;
    (places.len(), [mean(0), mean(1)])
}

#[test]
fn squares_lie_where_they_should() {
    // From below: violet, yellow; nothing, no number.
    let squares = [Some(0.0), Some(1.0), None, Some(f64::NAN)];
    let sheet = sheet(panel(2, &squares), ColourScale::Linear);
    let [violet, yellow, grey] = [VIOLET, YELLOW, GREY].map(|colour| pixels(&sheet, colour));
    assert!(
        violet.0 > 10_000 && violet.0.abs_diff(yellow.0) < violet.0 / 20 && grey.0.abs_diff(yellow.0) < grey.0 / 20
    );
    let edge = (violet.0 as f64).sqrt();
    let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 0.05 * edge && (a[1] - b[1]).abs() < 0.05 * edge;
    assert!(near(yellow.1, [violet.1[0] + edge, violet.1[1]]), "{violet:?} {yellow:?}");
    assert!(near(grey.1, [yellow.1[0], yellow.1[1] - edge]), "{yellow:?} {grey:?}");
}

#[test]
fn scales_of_colours_show_what_they_can() {
    let squares = [Some(0.0), Some(1.0), Some(10.0), Some(-3.0), Some(1.5), Some(9.0)];
    let logarithmic = sheet(panel(6, &squares), ColourScale::Logarithmic);
    assert!(pixels(&logarithmic, GREY).0 > 0, "what is not positive has no colour");
    assert!(pixels(&logarithmic, VIOLET).0 > 0 && pixels(&logarithmic, YELLOW).0 > 0);
    let whole = sheet(panel(3, &[Some(1.0), Some(2.0), Some(3.0)]), ColourScale::Whole);
    assert_eq!(pixels(&whole, VIOLET).0 / 1000, pixels(&whole, YELLOW).0 / 1000);
    let svg = String::from_utf8(encode(&whole, ImageFormat::Svg).unwrap()).unwrap();
    assert!([">1<", ">2<", ">3<"].iter().all(|label| svg.contains(label)) && !svg.contains(">1.5<"));
    for squares in
        [&[Some(4.0)][..], &[Some(f64::NAN)], &[Some(-1.0)], &[Some(0.0), Some(1e300)], &[None, Some(1e-300)]]
    {
        for scale in [ColourScale::Linear, ColourScale::Logarithmic, ColourScale::Whole] {
            let svg = encode(&sheet(panel(1, squares), scale), ImageFormat::Svg).unwrap();
            let svg = String::from_utf8(svg).unwrap();
            assert!(
                !svg.lines().any(|line| !line.starts_with("<image") && line.contains("NaN")),
                "{squares:?} {scale:?}"
            );
        }
    }
}

#[test]
fn edges_are_named_where_they_are_drawn() {
    let mut panel = panel(2, &[Some(0.0), None]);
    let corners = vec![[1, 0], [1, 1]];
    panel.edges = vec![VoxelEdge { corners: corners.clone(), kind: 1 }, VoxelEdge { corners, kind: 7 }];
    let mut sheet = sheet(panel, ColourScale::Linear);
    sheet.edges_title = "Boundary:".into();
    sheet.edges = ["one", "two"].map(|words| (words.to_owned(), Colour::VERMILION)).into();
    let svg = String::from_utf8(encode(&sheet, ImageFormat::Svg).unwrap()).unwrap();
    assert!(svg.contains("Boundary:") && svg.contains(">two<") && !svg.contains(">one<"), "{svg}");
    assert_eq!(svg.matches("#d55e00").count(), 2, "the line and its sample: {svg}");
}

#[test]
fn a_sheet_without_squares_is_refused() {
    let empty = |result: Result<_, ReportError>| matches!(result, Err(ReportError::Empty { .. }));
    assert!(empty(VoxelSheet::default().draw()));
    for panel in [panel(0, &[]), panel(2, &[None, None]), VoxelPanel::default()] {
        assert!(empty(sheet(panel, ColourScale::Linear).draw()));
    }
    let uneven = sheet(panel(2, &[Some(1.0), None, Some(2.0)]), ColourScale::Linear);
    assert!(matches!(uneven.draw(), Err(ReportError::Length { .. })));
    let lost = sheet(panel(0, &[Some(1.0)]), ColourScale::Linear);
    assert!(matches!(lost.draw(), Err(ReportError::Length { .. })));
}

#[test]
fn bars_end_at_their_bounds() {
    let series = |bounds: Vec<[f64; 2]>| {
        let points = (1..=bounds.len()).map(|k| [k as f64, 10.0]).collect();
        Series::scatter("", points, Marker::Circle).colour(Colour::VERMILION).bars(bounds)
    };
    let svg = |bounds: Vec<[f64; 2]>| {
        let y = AxisLabel::logarithmic("y", "");
        let curves = Curves { x: AxisLabel::linear("x", ""), y, series: vec![series(bounds)], ..Curves::default() };
        String::from_utf8(encode(&curves, ImageFormat::Svg).unwrap()).unwrap()
    };
    let lines = |text: &str| text.matches("stroke=\"#d55e00\"").count();
    // A bar is a line with two short ones across; one that leaves the axis has no end there, an unknown one is none.
    assert_eq!(lines(&svg(vec![[5.0, 20.0]])), 3);
    assert_eq!(lines(&svg(vec![[-1.0, 20.0]])), 2);
    assert_eq!(lines(&svg(vec![[f64::NAN, 20.0], [f64::NAN; 2]])), 3);
    assert!(!svg(vec![[f64::NEG_INFINITY, f64::INFINITY], [0.0, 30.0]]).contains("NaN"));
    let wrong = Series { band: vec![[0.0, 1.0]], ..series(vec![[5.0, 20.0]; 2]) };
    let curves = Curves { series: vec![wrong], ..Curves::default() };
    assert!(matches!(curves.draw(), Err(ReportError::Length { .. })));
}
