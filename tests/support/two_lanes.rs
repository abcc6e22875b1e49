//! The lanelet2 map of a straight road of two lanes.

/// Lanelets 1, 2, 3 between these x, metres, of which 2 turns left; 11, 12, 13 to their left. Lanes are 3.5 m
/// wide, the right one along y = 0.
pub(crate) fn osm(xs: [i32; 4]) -> String {
    let mut text = "<osm>\n".to_owned();
    for (row, y) in [-1.75, 1.75, 5.25].iter().enumerate() {
        for (column, x) in xs.iter().enumerate() {
            text += &format!(
                "<node id='{}' lat='0' lon='0'><tag k='local_x' v='{x}'/><tag k='local_y' v='{y}'/></node>\n",
                row * 10 + column + 1
            );
        }
        for piece in 1..=3 {
            let from = row * 10 + piece;
            text += &format!("<way id='{}'><nd ref='{from}'/><nd ref='{}'/></way>\n", 100 + from, from + 1);
        }
    }
    for row in 0..2 {
        for piece in 1..=3 {
            let (left, right) = (110 + row * 10 + piece, 100 + row * 10 + piece);
            let turn = if (row, piece) == (0, 2) { "<tag k='turn_direction' v='left'/>" } else { "" };
            text += &format!(
                "<relation id='{}'><member type='way' ref='{left}' role='left'/>\
                 <member type='way' ref='{right}' role='right'/><tag k='type' v='lanelet'/>\
                 <tag k='subtype' v='road'/>{turn}</relation>\n",
                row * 10 + piece
            );
        }
    }
    text + "</osm>\n"
}
