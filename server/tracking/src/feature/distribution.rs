//! Even spread of corners by a quad-tree: the largest node (of equals the fullest) is split until there are as many nodes as corners wanted,
//! then each node keeps its strongest corner (as Mur-Artal's tracker does; our own formulation).

use std::collections::BinaryHeap;

use super::fast::Corner;

/// A rectangle `[x0, x1) x [y0, y1)` and the range of its corners in the working array; ordered by split priority.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Node {
    area: u64,
    corners: usize,
    first: usize,
    x0: u32,
    y0: u32,
    x1: u32,
    y1: u32,
}

impl Node {
    fn new(first: usize, corners: usize, [x0, y0, x1, y1]: [u32; 4]) -> Self {
        let area = u64::from(x1 - x0) * u64::from(y1 - y0);
        Self { area, corners, first, x0, y0, x1, y1 }
    }

    fn can_split(&self) -> bool {
        self.corners > 1 && (self.x1 - self.x0 > 1 || self.y1 - self.y0 > 1)
    }
}

/// Chooses about `wanted` of the corners (never more than three above it), the strongest of each part of the image.
pub fn distribute(mut corners: Vec<Corner>, (width, height): (u32, u32), wanted: usize) -> Vec<Corner> {
    if corners.len() <= wanted {
        return corners;
    }
    let mut open: BinaryHeap<Node> = root_nodes(&mut corners, width, height).collect();
    let (mut closed, mut scratch) = (Vec::new(), Vec::new());
    while open.len() + closed.len() < wanted {
        let Some(node) = open.pop() else { break };
        if node.can_split() {
            open.extend(split(&mut corners, &node, &mut scratch));
        } else {
            closed.push(node);
        }
    }
    closed.extend(open.into_vec());
    closed.sort_unstable_by_key(|node| (node.y0, node.x0));
    closed.iter().filter_map(|node| strongest(&corners[node.first..node.first + node.corners])).collect()
}

/// Square-ish start nodes side by side, so that a wide image is not split into slivers.
fn root_nodes(corners: &mut [Corner], width: u32, height: u32) -> impl Iterator<Item = Node> {
    let count = (f64::from(width) / f64::from(height)).round().max(1.0) as u32;
    corners.sort_by_key(|corner| corner.x * count / width);
    let mut first = 0;
    let mut nodes = Vec::with_capacity(count as usize);
    for column in 0..count {
        let length = corners[first..].iter().take_while(|corner| corner.x * count / width == column).count();
        let edge = |column: u32| (column * width).div_ceil(count);
        nodes.push(Node::new(first, length, [edge(column), 0, edge(column + 1), height]));
        first += length;
    }
    nodes.into_iter().filter(|node| node.corners > 0)
}

/// Sorts a node's corners by quadrant, those of a quadrant in the order they had.
fn split(
    corners: &mut [Corner],
    node: &Node,
    scratch: &mut Vec<Corner>,
) -> impl Iterator<Item = Node> + use<> {
    let (middle_x, middle_y) = ((node.x0 + node.x1) / 2, (node.y0 + node.y1) / 2);
    let bounds = [
        [node.x0, node.y0, middle_x, middle_y],
        [middle_x, node.y0, node.x1, middle_y],
        [node.x0, middle_y, middle_x, node.y1],
        [middle_x, middle_y, node.x1, node.y1],
    ];
    let quadrant =
        |corner: &Corner| 2 * usize::from(corner.y >= middle_y) + usize::from(corner.x >= middle_x);
    let part = &mut corners[node.first..node.first + node.corners];
    scratch.clear();
    scratch.extend_from_slice(part);
    let mut counts = [0; 4];
    for corner in scratch.iter() {
        counts[quadrant(corner)] += 1;
    }
    let mut next = [0, counts[0], counts[0] + counts[1], counts[0] + counts[1] + counts[2]];
    for corner in scratch.iter() {
        let place = &mut next[quadrant(corner)];
        part[*place] = *corner;
        *place += 1;
    }
    let mut first = node.first;
    let children: [Node; 4] = std::array::from_fn(|child| {
        first += if child == 0 { 0 } else { counts[child - 1] };
        Node::new(first, counts[child], bounds[child])
    });
    children.into_iter().filter(|child| child.corners > 0)
}

/// The strongest; of equals the first in row order.
fn strongest(corners: &[Corner]) -> Option<Corner> {
    corners.iter().copied().max_by_key(|corner| (corner.score, std::cmp::Reverse((corner.y, corner.x))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    /// Two thousand corners, nine tenths of them in one corner of the image.
    fn crowded() -> Vec<Corner> {
        let mut random = Pcg64Mcg::new(5);
        let mut corner = |width: u32, height: u32| Corner {
            x: random.random_range(0..width),
            y: random.random_range(0..height),
            score: random.random_range(1..200),
        };
        let mut corners: Vec<_> = (0..1800).map(|_| corner(80, 60)).collect();
        corners.extend((0..200).map(|_| corner(640, 480)));
        corners
    }

    #[test]
    fn as_many_as_wanted_are_kept() {
        let kept = distribute(crowded(), (640, 480), 300).len();
        assert!((300..=303).contains(&kept), "{kept}");
    }

    #[test]
    fn a_crowd_does_not_starve_the_rest_of_the_image() {
        let outside = |corners: &[Corner]| corners.iter().filter(|c| c.x >= 80 || c.y >= 60).count();
        let kept = distribute(crowded(), (640, 480), 300);
        assert!(outside(&kept) > 140, "{} of {} outside the crowd", outside(&kept), kept.len());
    }

    #[test]
    fn few_corners_are_all_kept() {
        assert_eq!(distribute(crowded(), (640, 480), 5000).len(), 2000);
    }

    #[test]
    fn corners_at_one_place_end_the_splitting() {
        let corners = vec![Corner { x: 3, y: 3, score: 9 }; 50];
        assert_eq!(distribute(corners, (64, 48), 20).len(), 1);
    }
}
