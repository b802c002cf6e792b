// The answers of the server and of the worker as host/session/src serialises them, host/workbench/src and host/web/src beside it; where Rust has an Option there is a null. A plain `number`
// is null, too, where Rust's is not finite: said where that is more than a fault of the program.

/** What is wrong, and what to do about it. */
interface Fault { message: string; help: string }
/** A value with its standard uncertainty (k = 1). */
interface Quantity { value: number; u: number | null }
type Axis = "mid" | "front";
/** From one time to another, s; null for the record's end on that side. */
type Span = [from: number | null, to: number | null];
type Column = (number | null)[];

// GET /api/state (state.rs)

type Use = "fit" | "hold_out" | "out";
interface Release {
  id: number; name: string; file: string; condition: string;
  spring: string | null; axis: Axis | null; wind_speed_m_s: number | null;
  used: Use; badge: "adequate" | "structured" | "bad" | "pending";
  verdict: string; over_noise: number | null; fault: Fault | null; is_left_out: boolean;
}
/** The value is null where each release has its own. */
interface Parameter { name: string; unit: string; value: number | null; u: number | null; free: boolean }
interface ModelEffect { effect: string; title: string; parameters: Parameter[] }
interface Model {
  file: string; exists: boolean; edited: boolean; changed_records: string[]; read_only: string | null;
  fault: Fault | null; effects: ModelEffect[]; ticks_changed: boolean;
}
interface Overall {
  over_noise: number | null; held_out: number | null; held_out_is: string;
  status: "unknown" | "adequate" | "structured"; verdict: string; left_out: string | null;
}
/** A step of the journal. */
interface Step {
  step: number; time_utc: string; action: "fit" | "add" | "remove" | "reject" | "return" | "edit";
  what: string; of: string; why: string | null; command: string; over_noise: number | null; held_out: number | null;
}
/** How often it has looked whether to stop is not known of a worker. */
interface Progress { what: string; seconds: number; looks: number | null; is_stopping: boolean }
interface Ended extends Fault { job: Job; is_error: boolean; number: number }
interface State {
  model: Model; overall: Overall; releases: Release[]; steps: Step[]; has_campaign: boolean; own: string[];
  job: Progress | null; ended: Ended | null;
  /** Null where there is no server. */
  live: LiveState | null;
}

// GET /api/curves, /api/view, /api/candidates (show.rs)

/** The words and units of axes. */
interface Units {
  recorded: string; unit: string; coordinate: string; word: string; rate: string; of: string; rate_unit: string;
  moment: string; shows_rest: boolean;
}
/** Two values a stretch of time. What the model says is there once it has been computed. */
interface Curves {
  release: number; whole_s: [number, number]; time_s: number[]; measured_deg: Column; units: Units; cut_s: Span | null;
  model_deg?: Column; residual_deg?: Column; noise_deg?: number; release_s?: number;
  analysed_s?: [number, number]; analysed?: [string, string];
  ghost?: string; ghost_title?: string; ghost_deg?: Column; ghost_residual_deg?: Column;
}
/** A window of three cycles: the uncertainties of wn and zeta are each behind its value. */
type AmplitudePoint = [amplitude_deg: number, wn_rad_s: number, wn_u: number, zeta: number, zeta_u: number, time_s: number];
/** A moment over a rate or an angle. */
type CutPoint = [x: number, moment_rad_s2: number, u_rad_s2: number];
type PhaseCell = [yaw_deg: number, rate_deg_s: number, moment_rad_s2: number];
/** Where a model fails. */
interface Where {
  phase: PhaseCell[]; damping_law: CutPoint[]; stiffness_law: CutPoint[];
  /** Of the moments, by the record's noise alone. */
  noise: number;
  frequency: [hz: number, share: number, over_noise: number][];
}
interface States { time_s: number[]; yaw_deg: number[]; rate_deg_s: number[] }
interface Shown extends Quantity { text: string }
interface View {
  release: number; over_noise: number; is_explained: boolean;
  correlation: number; correlation_of_white: number; is_white: boolean;
  noise_rms_deg: number; residual_rms_deg: number; natural_frequency_rad_s: Shown; damping_ratio: Shown;
  measured: AmplitudePoint[]; predicted: { name: string; points: AmplitudePoint[] } | null;
  trials: { effect: string; points: AmplitudePoint[] | null }[];
  where: Where; ghost?: Where; states: States;
}
interface Pending { release: number; pending: true }
/** An effect that the model may lack; what it would do, where it has been tried. */
interface Candidate {
  effect: string; title: string; formula: string; cause: string; fingerprint: string; confirm: string; remove: string;
  release: string; is_own: boolean; can_be_tried: boolean; is_tried: boolean; is_suggested: boolean;
  rejected: { step: number; why: string | null } | null;
  evidence?: number; over_noise?: number; converged?: boolean;
}
type Status = "adequate" | "explained" | "mostly_explained" | "unexplained";
/** The diagnosis of a release, null before there is one, and the effects, best first. */
interface Candidates {
  release: number; verdict: string | null; status: Status | null; sentence: string | null;
  left: { rms_deg: number; share_of_amplitude: number; share_of_misfit: number; where: string } | null;
  refused: string[] | null; is_drawn: boolean; alike: string[]; together: [text: string, sentence: string] | null;
  ticked: number; candidates: Candidate[];
}

// GET /api/law (law.rs), /api/derivatives (show.rs)

/** The missing moment along the cuts of the phase plane; `u` of the measured law alone. */
interface Cuts<Moment = number> {
  damping_law: { rate_deg_s: number[]; moment_rad_s2: Moment[]; u?: number[] | null };
  stiffness_law: { yaw_deg: number[]; moment_rad_s2: Moment[]; u?: number[] | null };
}
type Cut = keyof Cuts;
type BeforeAfter = [before: number, after: number];
interface MeasuredFit { may_drive: boolean; residual_over_noise: BeforeAfter; held_out_over_noise: BeforeAfter }
/** What shows that no law of angle and rate holds the moment. */
interface LeftByLaw { x_label: string; y_label: string; at: number | null; lines: { x: number[]; y: number[] }[] }
/** A formula that the law may be. */
interface Formula {
  form: string; title: string; formula: string; file: string; residual_over_noise: number; held_out_over_noise: number;
  numbers: string; cuts: Cuts | null;
}
interface Found {
  names: Formula[]; alike: string | null; memory: string | null; beside: string | null; left: LeftByLaw | null;
  remembers: string | null;
}
/** A first law is neither measured with its uncertainty nor given formulas yet. */
interface Law {
  file: string; yaw_deg: number; rate_deg_s: number; units: [string, string]; cuts: Cuts | null;
  measured?: MeasuredFit; found?: Found;
}
/** The derivatives on one spring at one wind speed (derivatives/table.rs). */
interface Point {
  spring: string; wind_speed_m_s: number; at?: Record<string, number | string>; reduced_frequency: number;
  cn_beta: Quantity; cn_r: Quantity; cy_beta: Quantity | null; cy_r: Quantity | null;
}
interface Judged {
  verdict: string; effects: string[]; origin: Record<string, "mechanical" | "aerodynamic" | "undecided">;
  origin_reason: Record<string, string>; derivatives: { before: Point[]; after: Point[] } | null;
}
interface Critical { text: string; by: string; rows: [wind_speed_m_s: number, zeta: Quantity | null, limit_cycle_deg: Quantity | null][] }
type Derivatives = { has_campaign: false }
  | { has_campaign: true; before: Point[] | null; after: Point[] | null; critical_speed: Critical[]; judged?: Judged };

// /api/campaign and below (campaign.rs), /api/drop, /api/as_read (dropped.rs), /api/preview (own.rs)

interface Condition { axis: Axis; wind_speed_m_s: number }
/** A record and what is known of it. */
interface PlacedRecord {
  file: string; spring: string | null; axis: Axis | null; wind_speed_m_s: number | null; unknown: string[];
  at?: Record<string, number | string>;
}
interface CampaignFolder { folder: string; files: string[]; numbers: { name: string; what: string }[]; stiffness: string; exists: boolean }
interface CampaignForm {
  folder: string; placed: PlacedRecord[]; given: { numbers: Record<string, number>; stiffness_n_per_m: Record<string, number> };
}
interface Checked { wrong: string[]; doubtful: string[]; notes: string[] }
interface Written extends Checked { file: string; is_open: boolean }
/** How a file's channels are read, as far as it does not say it itself. */
interface Reading { time?: string; yaw?: string; quantity?: string; unit?: string; rate_hz?: number }
interface Channel { name: string; unit: string | null; numbers: number; wrong: string | null; sketch: Column }
/** A file that has to be asked about. */
interface Asked { file: string; is_clear: false; why: string; help: string; channels: Channel[] }
interface OwnParameter { name: string; unit: string; start: string; min: string; max: string }
interface OwnForm { id: string; title: string; moment: string; parameters: OwnParameter[]; states: { name: string; unit: string; rate: string; start: string }[] }
interface OwnFault extends Fault { at: { field: string; column: number; width: number } | null }
interface OwnLaw extends Cuts<number | null> { id: string; text: string; warnings: string }

// GET /api/live and the news (session/src/followed.rs, protocol/src/live/item.rs, protocol/src/follow.rs)

interface Replay {
  file: string; started: string | null; is_finished: boolean; from_s: number; to_s: number; at_s: number;
  is_playing: boolean; speed: number;
}
interface LiveState {
  epoch: number; is_followed: boolean; device: string; samples: number; missing_samples: number;
  recording: string | null; replay: Replay | null; fault: Fault | null;
  /** Of the built-in rig, times real time; null before a board. */
  speed: number | null;
  measuring: Measuring | null;
  disk: { bytes_an_hour: number; free_bytes: number | null } | null;
}
/** A campaign or a condition that is being measured, as it was asked for. */
interface Measuring {
  wanted: { campaign: string | null; condition: string | null; spring: string | null; axis: string | null; wind_speed_m_s: number | null };
  has_ended: boolean;
}
/** The least and the largest of each ten samples. */
interface LiveTrace { time_s: number[]; low_deg: number[]; high_deg: number[] }
interface Place { time_s: number; text: string }
interface LiveHistory extends LiveState { trace: LiveTrace; lines: LogLine[]; places: Place[] }
/** A number of an effect that a device's network says. */
interface DeviceNumber { name: string; unit: string; value: number; u?: number }
/** The uncertainties are null in sessions that were stored before devices said them. */
interface DeviceDerivatives { cn_beta: number; cn_beta_u: number | null; cn_r: number; cn_r_u: number | null }
interface Logged { text: string; number: number }
interface WindowLine extends Logged {
  event: "window"; time_s: number; natural_frequency_rad_s: number; damping_ratio: number; numbers: DeviceNumber[];
}
interface ReleaseLine extends Logged { event: "release"; time_s: number; numbers: DeviceNumber[]; derivatives: DeviceDerivatives | null }
interface RefinedLine extends Logged { event: "refined"; time_s: number; derivatives: DeviceDerivatives | null }
interface ConditionLine extends Logged { event: "condition"; time_s: number; spring: string; axis: Axis; wind_speed_m_s: number }
interface HappenedLine extends Logged {
  event: "device" | "gap" | "phase" | "events_lost" | "restarted" | "restored" | "forgotten" | "silent" | "disconnected"
    | "back" | "derivatives" | "mark" | "record" | "trace_ended";
  time_s: number;
}
interface SaidLine extends Logged { event: "refused" | "recorded" | "writing" | "waiting" | "written" }
type LogLine = WindowLine | ReleaseLine | RefinedLine | ConditionLine | HappenedLine | SaidLine;
interface StoredSession {
  session: string; started: string; duration_s: number | null; releases: number; marks: number;
  is_finished: boolean; is_damaged: boolean;
}
interface LiveNews { kind: "live"; state: LiveState; trace?: LiveTrace; lines?: LogLine[] }
type News = { kind: "state" } | { kind: "law" } | { kind: "job"; job: Progress | null } | { kind: "view"; release: number } | LiveNews;

// POST /api/do (api.rs, work.rs)

/** What takes its time. */
type Job = { do: "fit" } | { do: "judge" } | { do: "together" } | { do: "law"; may_drive?: boolean }
  | { do: "add"; effect: string; why?: string | null; may_drive?: boolean }
  | { do: "remove" | "reject"; effect: string; why?: string | null } | { do: "return"; step: number; why?: string | null }
  | { do: "diagnose"; release: number } | { do: "try"; release: number; effect: string };
/** A condition over and over, or a campaign (campaign/src/plan.rs). */
type Wanted = { campaign: string | null }
  | { condition: string | null; spring: string | null; axis: string | null; wind_speed_m_s: number | null };
/** What is done with what is live. */
type LiveOrder = { do: "disconnect" | "record" | "stop_recording" | "skip" | "back" | "play" | "pause" }
  | { do: "connect"; device: string; speed?: number } | { do: "replay"; session: string } | { do: "mark"; text: string }
  | { do: "measure"; wanted: Wanted } | { do: "speed"; times: number } | { do: "jump"; time_s: number };
type Order = Job | LiveOrder | { do: "cancel" } | { do: "tick"; releases: number[]; used: Use }
  | { do: "open"; file: string; reading?: Reading } | { do: "between"; release: number; from_s: number | null; to_s: number | null }
  | { do: "define" | "save"; form: OwnForm } | { do: "write_campaign"; over: boolean } & CampaignForm | Close;
type Done<O> = O extends { do: "open" } ? { release: number } : O extends { do: "define" } ? { effect: string }
  : O extends { do: "save" } ? { file: string } : O extends { do: "write_campaign" } ? Written : unknown;

/** What is answered to GET. */
interface Answers {
  "/api/state": State; "/api/candidates": Candidates; "/api/law": Law | null; "/api/derivatives": Derivatives;
  "/api/curves": Curves | { fault: Fault }; "/api/view": View | Pending | { fault: Fault };
  "/api/campaign": CampaignFolder; "/api/files": { files: string[] }; "/api/live": LiveHistory;
  "/api/report": { html: string }; "/api/devices": { ports: { path: string; description: string }[] }; "/api/sessions": { sessions: StoredSession[] };
}
/** What is sent by POST, and the answer to it. */
interface Posts {
  "/api/campaign/pattern": { body: { folder: string; pattern: string }; answer: { placed: PlacedRecord[] } | { fault: Fault } };
  "/api/campaign/check": { body: CampaignForm; answer: Checked };
  "/api/as_read": { body: { file: string; reading: Reading }; answer: { file: string; is_clear: true } | Asked };
  "/api/preview": { body: { release: number | null; form: OwnForm }; answer: { error: OwnFault } | OwnLaw };
}

// What a page without a server is told beside that (host/web).

/** What a verb prints, with and without --json. */
interface Printed { text: string; sentence: string; json: object }
interface Answers { "/api/printed": Printed; "/api/held": { files: { name: string; crc32: string }[] } }
type Close = { do: "close" };
/** yawrig compiled to WebAssembly, as wasm-bindgen makes it. */
declare module "*/yawrig.js" {
  export function initSync(what: { module: WebAssembly.Module }): unknown;
  export function begin(says: (text: string) => void, tells: (news: string) => void): void;
  export function file(name: string): Uint8Array | undefined;
  export function hold(name: string, bytes: Uint8Array): void;
  export function take(name: string, bytes: Uint8Array): string;
  export function answer(path: string, asked: string): string;
  export function board_begin(name: string, says: (kind: string, of: any) => void): void;
  export function board_came(bytes: Uint8Array): void;
  export function board_gone(why: string): void;
  export function board_back(): void;
  export function board_turn(): void;
  export function board_order(order: string): void;
  export function board_network(name: string, bytes: Uint8Array): void;
  export function board_end(): void;
}
/** A port of Web Serial, as far as it is used (TypeScript's library has none of it). */
interface WebPort extends EventTarget {
  readonly readable: ReadableStream<Uint8Array<ArrayBuffer>> | null;
  readonly writable: WritableStream<Uint8Array> | null;
  getInfo(): { usbVendorId?: number; usbProductId?: number };
  open(how: { baudRate: number; bufferSize: number }): Promise<void>;
  close(): Promise<void>;
}
interface WebSerial extends EventTarget { requestPort(): Promise<WebPort> }

// The page (index.html, server.html, static.html, live.html, board.html, drawn.html, panels.html, and what the scripts put there). `pure.test.js` holds the names against it.

type ButtonId = "cancel-button" | "diagnose-button" | "fit-button" | "report-button" | "own-more-states" | "help-button" | "law-button" | "live-button" | "live-close"
  | "live-connect" | "live-mark" | "live-record" | "measure-back" | "measure-begin" | "measure-skip" | "open-button" | "replay-play"
  | "tab-derivatives" | "tab-effects" | "tab-own" | "together-button" | "uncut-button" | "own-try" | "own-add" | "own-save"
  | "board-save" | "board-set" | "board-write" | "close-button" | "folder-button" | "phone-button" | "save-button";
type DialogId = "campaign-dialog" | "drop-dialog" | "help" | "open-dialog" | "phone-dialog" | "save-dialog";
type DetailsId = "board-about" | "board-first" | "printed";
type InputId = "board-area" | "board-density" | "board-file" | "board-inertia" | "board-length" | "board-spring" | "board-wind" | "open-file" | "open-folder" | "live-note" | "measure-file" | "measure-spring" | "measure-wind" | "replay-time";
type SelectId = "board-axis" | "live-device" | "live-session" | "live-source" | "live-speed" | "measure-axis" | "measure-what" | "replay-place"
  | "replay-speed";
type TableId = "measure-points";
type ElementOf<Id> = Id extends ButtonId ? HTMLButtonElement : Id extends DialogId ? HTMLDialogElement
  : Id extends DetailsId ? HTMLDetailsElement : Id extends InputId ? HTMLInputElement : Id extends SelectId ? HTMLSelectElement : Id extends TableId ? HTMLTableElement : HTMLElement;
type Tag = keyof HTMLElementTagNameMap;
/** The target of what a field hears is the field. */
type Heard<T extends Tag> = {
  [E in keyof HTMLElementEventMap as `on${E}`]?: (event: T extends "input" | "select" | "textarea"
    ? HTMLElementEventMap[E] & { target: HTMLElementTagNameMap[T] } : HTMLElementEventMap[E]) => void;
};
/** What an element is made with: its properties, what it hears, and attributes that are no properties. */
type Properties<T extends Tag> = Partial<Omit<HTMLElementTagNameMap[T], keyof Heard<T>>> & Heard<T>
  & { [attribute: `data-${string}` | `aria-${string}`]: string | number | boolean | null };

// What the scripts hand to each other.

/** Lays a trial, or none, over the panels. */
type Lay = { do: "lay"; ghost: string | null };
type Act = (what: Job | Lay) => Promise<void>;
type ActLive = (what: LiveOrder) => Promise<void>;
type Choose = (release: number) => unknown;
/** Says what was thrown: a fault. */
type Failed = (error: unknown) => void;

// The data in a report's page (report/src/lib.rs, report/src/trace.rs)

/** Absent for an angle in deg, yaw. */
interface Said { quantity?: string; unit?: string; amplitude_unit?: string; motion?: string }
interface Trace {
  said?: Said; time_s: number[]; measured_deg: number[];
  models: { name: string; yaw_deg: number[]; residual_deg: number[] }[];
}
interface ReportData { releases: { trace: Trace | null }[] }
