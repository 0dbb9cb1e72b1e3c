/** A 2D context that draws nothing and records its calls. */
interface Call {
  readonly name: string;
  readonly args: readonly unknown[];
  /** The drawing state at the time of the call. */
  readonly state: Readonly<Record<string, unknown>>;
}

const contexts = new WeakMap<HTMLCanvasElement, FakeContext>();

export class FakeContext {
  readonly calls: Call[] = [];
  readonly state: Record<string, unknown> = {};

  static recordOf(canvas: HTMLCanvasElement): FakeContext | undefined {
    return contexts.get(canvas);
  }

  static of(canvas: HTMLCanvasElement): CanvasRenderingContext2D {
    let known = contexts.get(canvas);
    if (!known) {
      known = new FakeContext(canvas);
      contexts.set(canvas, known);
    }
    return known.asContext();
  }

  constructor(readonly canvas: HTMLCanvasElement = document.createElement('canvas')) {}

  named(name: string): Call[] {
    return this.calls.filter((call) => call.name === name);
  }

  asContext(): CanvasRenderingContext2D {
    const { calls, state, canvas } = this;
    return new Proxy(state, {
      get: (_, property) => {
        const name = String(property);
        if (name === 'canvas') return canvas;
        if (name === 'measureText') return (text: string) => ({ width: text.length * 6 });
        if (name in state) return state[name];
        return (...args: unknown[]) => {
          calls.push({ name, args, state: { ...state } });
          return undefined;
        };
      },
      set: (_, property, value: unknown) => {
        state[String(property)] = value;
        return true;
      },
    }) as unknown as CanvasRenderingContext2D;
  }
}
