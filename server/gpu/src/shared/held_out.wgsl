// Pixels that the warp solver may be told to leave out, so that the error there says whether the model bends as the
// tissue does or only where it is pulled: every 7th block of 16 x 16 pixels, along diagonals.

const HELD_OUT_BLOCK_PX: u32 = 16u;
const HELD_OUT_ONE_IN: u32 = 7u;

fn is_held_out(pixel: vec2<u32>) -> bool {
    let block = pixel / HELD_OUT_BLOCK_PX;
    return (block.x + 3u * block.y) % HELD_OUT_ONE_IN == 0u;
}
