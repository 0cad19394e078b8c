// How a surfel looks, in pictures and in windows alike; `Coloring` in dense/src/render is its CPU side.

const COLORING_COLOUR: u32 = 0u;
const COLORING_SHAPE: u32 = 1u;
const COLORING_NORMAL: u32 = 2u;
const COLORING_CONFIDENCE: u32 = 3u;

const CLAY = vec3<f32>(204.0, 199.0, 191.0);

// Dark violet over green to yellow; lightness grows all the way.
fn mapped_color(share: f32) -> vec3<f32> {
    var stops = array<vec3<f32>, 5>(
        vec3<f32>(68.0, 1.0, 84.0), vec3<f32>(59.0, 82.0, 139.0), vec3<f32>(33.0, 145.0, 140.0),
        vec3<f32>(94.0, 201.0, 98.0), vec3<f32>(253.0, 231.0, 37.0));
    let place = clamp(share, 0.0, 1.0) * 4.0;
    let start = min(u32(place), 3u);
    return mix(stops[start], stops[start + 1u], place - f32(start));
}

// Levels 0 to 255 of a surfel of this colour, whose unit normal is in the camera's frame; `facing` is the cosine between
// the normal and the way to the camera, and `confidence` goes from 0 to 1. The light is the scope's: at the camera.
fn shaded(coloring: u32, rgb: vec3<f32>, normal: vec3<f32>, facing: f32, confidence: f32) -> vec3<f32> {
    switch coloring {
        case COLORING_SHAPE: {
            return CLAY * (0.16 + 0.84 * facing * facing);
        }
        case COLORING_NORMAL: {
            // as the usual normal maps: x right, y up, z towards the eye
            return 127.5 + 127.5 * vec3<f32>(normal.x, -normal.y, -normal.z);
        }
        case COLORING_CONFIDENCE: {
            return mapped_color(confidence) * (0.82 + 0.18 * facing);
        }
        default: {
            return rgb * (0.55 + 0.45 * facing);
        }
    }
}
