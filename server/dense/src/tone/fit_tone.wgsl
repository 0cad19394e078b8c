#import light
#import color
#import fusion
// Gain and bias of a frame by least squares over the sums of sample_tone.wgsl. A weak prior holds the gain at the last
// frame's and the bias at zero, where the picture has too little contrast to tell them apart. Without enough of the model in
// view the last frame's tone stays; in the first frame the gain makes the model as bright as the picture. One invocation.

@group(0) @binding(0) var<storage, read> sums: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> tone: array<Tone>;

const INVOCATIONS: u32 = 256u;
const PAIRS_MIN: f32 = 200.0;
// the priors' weights, as shares of the data's
const GAIN_PRIOR: f32 = 0.002;
const BIAS_PRIOR: f32 = 0.05;
const GAIN_MIN: f32 = 1e-3;

@compute @workgroup_size(1)
fn fit_tone() {
    var channels = array<vec4<f32>, 3>();
    var counts = vec4<f32>(0.0);
    for (var i = 0u; i < INVOCATIONS; i++) {
        for (var row = 0u; row < 3u; row++) {
            channels[row] += sums[4u * i + row];
        }
        counts += sums[4u * i + 3u];
    }
    if tone[0].gain.w == 0.0 {
        let gain = select(1.0, counts.z / counts.y, counts.y > 0.0);
        tone[0].gain = vec4<f32>(vec3<f32>(gain), select(0.0, 1.0, counts.y > 0.0));
        tone[0].bias = vec4<f32>(0.0);
    }
    if counts.x < PAIRS_MIN {
        return;
    }
    for (var channel = 0u; channel < 3u; channel++) {
        let s = channels[channel];
        let squares = s.z * (1.0 + GAIN_PRIOR);
        let products = s.w + GAIN_PRIOR * s.z * tone[0].gain[channel];
        let pairs = counts.x * (1.0 + BIAS_PRIOR);
        let determinant = squares * pairs - s.x * s.x;
        if determinant > 0.0 {
            tone[0].gain[channel] = max((products * pairs - s.x * s.y) / determinant, GAIN_MIN);
            tone[0].bias[channel] = (squares * s.y - s.x * products) / determinant;
        }
    }
}
