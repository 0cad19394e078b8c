import { type Matrix4, Vector3 } from 'three';
import { carried, stretched } from './placement';

/** How the model is held: by no hand, by one, or by two. */
type Hold =
  | { readonly kind: 'none' }
  | { readonly kind: 'one'; readonly hand: number; readonly start: Matrix4; readonly placement: Matrix4 }
  | { readonly kind: 'two'; readonly start: readonly [Matrix4, Matrix4]; readonly placement: Matrix4 };

/**
 * Takes and moves the model with hands 0 and 1. A hand that is added or let go begins a new hold from where the
 * model then is, so that it never jumps.
 */
export class Grab {
  private hold: Hold = { kind: 'none' };
  private readonly holding = new Set<number>();

  /** `poseOf` says where a hand is: room_from_hand. */
  constructor(private readonly poseOf: (hand: number) => Matrix4) {}

  get active(): boolean {
    return this.hold.kind !== 'none';
  }

  take(hand: number, placement: Matrix4): void {
    this.holding.add(hand);
    this.begin(this.moved(placement));
  }

  release(hand: number, placement: Matrix4): void {
    if (this.holding.delete(hand)) this.begin(placement);
  }

  /** Where the model is now; `placement` itself while nobody holds it. */
  moved(placement: Matrix4): Matrix4 {
    const { hold } = this;
    switch (hold.kind) {
      case 'none':
        return placement;
      case 'one':
        return carried(hold.placement, hold.start, this.poseOf(hold.hand));
      case 'two':
        return stretched(hold.placement, handsOf(hold.start), handsOf([this.poseOf(0), this.poseOf(1)]));
    }
  }

  private begin(placement: Matrix4): void {
    const [hand] = this.holding;
    if (hand === undefined) this.hold = { kind: 'none' };
    else if (this.holding.size === 1) {
      this.hold = { kind: 'one', hand, start: this.poseOf(hand).clone(), placement: placement.clone() };
    } else {
      const start = [this.poseOf(0).clone(), this.poseOf(1).clone()] as const;
      this.hold = { kind: 'two', start, placement: placement.clone() };
    }
  }
}

function handsOf([first, second]: readonly [Matrix4, Matrix4]) {
  return {
    first: new Vector3().setFromMatrixPosition(first),
    second: new Vector3().setFromMatrixPosition(second),
  };
}
