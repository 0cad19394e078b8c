import { TrackingOutcome } from '../generated/mis_slam/v1/pose_pb';
import { SessionStatus } from '../generated/mis_slam/v1/session_pb';

/** The name of a session status in JSON (protocol/SPEC.md): `source_lost`; `unspecified` where not known. */
export function statusName(status: SessionStatus | undefined): string {
  return (SessionStatus[status ?? SessionStatus.UNSPECIFIED] ?? 'unspecified').toLowerCase();
}

/** The name of a tracking outcome in JSON: `not_initialized`; `unspecified` where not known. */
export function outcomeName(outcome: TrackingOutcome | undefined): string {
  return (TrackingOutcome[outcome ?? TrackingOutcome.UNSPECIFIED] ?? 'unspecified').toLowerCase();
}
