import { readFileSync } from 'node:fs';
import { create, fromBinary, type MessageInitShape, toBinary } from '@bufbuild/protobuf';
import type { WebSocket } from 'ws';
import type { View } from '../src/generated/mis_slam/v1/control_pb';
import { FromServerSchema, ToServerSchema } from '../src/generated/mis_slam/v1/envelope_pb';
import { ImageFormat } from '../src/generated/mis_slam/v1/image_pb';
import { TrackingOutcome } from '../src/generated/mis_slam/v1/pose_pb';
import { SessionStatus } from '../src/generated/mis_slam/v1/session_pb';
import { FakeModel } from './fake_model';
import { FakeShared } from './fake_shared';

const CAMERA = { widthPx: 320, heightPx: 240, fxPx: 300, fyPx: 300, cxPx: 159.5, cyPx: 119.5 };
const DURATION_S = 60;
const STATES_PER_S = 4;
const PREVIEWS_PER_S = 5;

type Body = NonNullable<MessageInitShape<typeof FromServerSchema>['body']>;

/** As protocol/SPEC.md has it. */
export interface ReplayChange {
  readonly paused?: boolean;
  readonly position_s?: number;
  readonly rate?: number;
}

/** One session with a synthetic model, poses and a still image, and the faults that tests ask for. */
export class FakeSession {
  readonly model: FakeModel;
  private readonly left = new Uint8Array(readFileSync('e2e/left.jpg'));
  private readonly viewers = new Set<WebSocket>();
  private readonly timers: NodeJS.Timeout[];
  private readonly startMs = Date.now();
  private readonly shared = new FakeShared();
  private status = SessionStatus.LIVE;
  private paused = false;
  private poses = 0;
  private replayAt = { positionS: 0, paused: false, rate: 1, ended: false };
  private reconstruction = 1;
  /** Viewers that want features. */
  private readonly curious = new Set<WebSocket>();
  /** Snapshots asked for by viewers. */
  resyncs = 0;
  /** What a viewer asked for last. */
  wishes: View | undefined;

  constructor(
    readonly id: string,
    surfels: number,
    private readonly epochsPerS: number,
    private readonly replays: boolean,
  ) {
    this.model = new FakeModel(surfels);
    this.timers = [
      setInterval(() => this.publishModel(), 1000 / epochsPerS),
      setInterval(() => this.publishState(), 1000 / STATES_PER_S),
      setInterval(() => this.publishPreview(), 1000 / PREVIEWS_PER_S),
    ];
  }

  /** Greets a viewer as soon as it has said hello, and seeds it. */
  admit(viewer: WebSocket): void {
    viewer.on('message', (data: Buffer) => {
      const { body } = fromBinary(ToServerSchema, new Uint8Array(data));
      if (body.case === 'hello') {
        send(viewer, { case: 'hello', value: { oldestVersion: 1, newestVersion: 1, software: 'fake' } });
        send(viewer, this.state());
        send(viewer, { case: 'shared', value: this.shared.scene });
        this.seed(viewer);
      } else if (body.case === 'sharedChange') {
        this.shared.apply(body.value);
        this.publish({ case: 'shared', value: this.shared.scene });
      } else if (body.case === 'resync') {
        this.resyncs += 1;
        this.seed(viewer);
      } else if (body.case === 'view') {
        this.wishes = body.value;
        if (body.value.features) this.curious.add(viewer);
        else this.curious.delete(viewer);
      }
    });
    viewer.on('close', () => {
      this.viewers.delete(viewer);
      this.curious.delete(viewer);
    });
  }

  /** Pauses, moves or speeds the replay, as the server does. */
  changeReplay({ paused, position_s: positionS, rate }: ReplayChange): void {
    const { replayAt } = this;
    replayAt.paused = paused ?? replayAt.paused;
    replayAt.rate = rate ?? replayAt.rate;
    if (positionS !== undefined) {
      replayAt.positionS = positionS;
      this.reconstruction += 1;
    }
    this.publish(this.state());
  }

  /** Nothing more comes from the model, pose and preview lanes; the state goes on saying `live`. */
  pause(): void {
    this.paused = true;
  }

  resume(): void {
    this.paused = false;
  }

  loseSource(): void {
    this.pause();
    this.status = SessionStatus.SOURCE_LOST;
    this.publish(this.state());
  }

  /** The session as the HTTP list has it. */
  summary(): Record<string, unknown> {
    return {
      session: this.id,
      status: SessionStatus[this.status]?.toLowerCase(),
      text: '',
      tracking: 'tracked',
      received_hz: this.epochsPerS,
      surfels: this.model.size,
      epoch: 1,
      viewers: this.viewers.size,
      model_age_ms: 40,
      replay: this.replays ? { recording: 'liver.mcap', ...this.replayAt } : null,
    };
  }

  stop(): void {
    for (const timer of this.timers) clearInterval(timer);
  }

  private seed(viewer: WebSocket): void {
    for (const chunk of this.model.snapshot()) send(viewer, { case: 'snapshot', value: chunk });
    this.viewers.add(viewer);
  }

  private publishState(): void {
    const { replayAt } = this;
    if (!replayAt.paused) replayAt.positionS = Math.min(replayAt.positionS + 1 / STATES_PER_S, DURATION_S);
    replayAt.ended = replayAt.positionS === DURATION_S;
    this.publish(this.state());
  }

  private get rests(): boolean {
    return this.paused || (this.replays && (this.replayAt.paused || this.replayAt.ended));
  }

  private publishModel(): void {
    if (this.rests) return;
    const timeS = (Date.now() - this.startMs) / 1000;
    this.publish({ case: 'epoch', value: this.model.advance(timeS) });
    this.publish(this.pose(timeS));
  }

  private publishPreview(): void {
    if (this.rests) return;
    const found = {
      stampNs: 0n,
      matched: grid(40, 20),
      deforming: [800, 480, 760, 470],
      others: grid(60, 31),
    };
    for (const viewer of this.curious) send(viewer, { case: 'features', value: found });
    const left = { format: ImageFormat.JPEG, widthPx: 320, heightPx: 240, data: this.left };
    this.publish({ case: 'preview', value: { stampNs: 0n, left } });
  }

  private pose(timeS: number): Body {
    this.poses += 1;
    const swing = 0.35 * Math.sin(0.5 * timeS);
    const worldFromCamera = {
      txM: 0.085 * Math.sin(swing),
      tyM: 0.008 * Math.sin(0.9 * timeS),
      tzM: 0.085 * (1 - Math.cos(swing)),
      qx: 0,
      qy: Math.sin(-swing / 2),
      qz: 0,
      qw: Math.cos(swing / 2),
    };
    return {
      case: 'pose',
      value: {
        stampNs: BigInt(Math.round(timeS * 1e9)),
        sequence: BigInt(this.poses),
        outcome: TrackingOutcome.TRACKED,
        worldFromCamera,
        matchedFeatures: 412,
        latencyMs: 31,
      },
    };
  }

  private state(): Body {
    return {
      case: 'state',
      value: {
        session: this.id,
        status: this.status,
        text: this.status === SessionStatus.SOURCE_LOST ? 'The cart is gone.' : '',
        sourcePresent: this.status === SessionStatus.LIVE,
        tracking: TrackingOutcome.TRACKED,
        receivedHz: this.paused ? 0 : this.epochsPerS,
        epoch: this.model.epoch,
        surfels: this.model.size,
        viewers: this.viewers.size,
        picture: 'good',
        camera: CAMERA,
        spanNs: BigInt(Date.now() - this.startMs) * 1_000_000n,
        reconstruction: this.reconstruction,
        ...this.replayState(),
      },
    };
  }

  private replayState() {
    if (!this.replays) return {};
    const { positionS, paused, rate, ended } = this.replayAt;
    const [positionNs, durationNs] = [ns(positionS), ns(DURATION_S)];
    return { replay: { recording: 'liver.mcap', positionNs, durationNs, paused, rate, ended } };
  }

  private publish(body: Body): void {
    for (const viewer of this.viewers) send(viewer, body);
  }
}

function ns(seconds: number): bigint {
  return BigInt(Math.round(seconds * 1e9));
}

/** Places all over the image, this many pixels apart, in quarter pixels. */
function grid(stepPx: number, firstPx: number): number[] {
  const places: number[] = [];
  for (let y = firstPx; y < CAMERA.heightPx; y += stepPx) {
    for (let x = firstPx; x < CAMERA.widthPx; x += stepPx) places.push(4 * x, 4 * y);
  }
  return places;
}

function send(viewer: WebSocket, body: Body): void {
  viewer.send(toBinary(FromServerSchema, create(FromServerSchema, { body })));
}
