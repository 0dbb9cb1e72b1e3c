import { type Pen, Sprites } from '../draw/surface';
import type { FakeContext } from './canvas';

export const penOn = (context: FakeContext, over: Partial<Pen> = {}): Pen => ({
  context: context.asContext(),
  size: { width: 400, height: 300 },
  ratio: 1,
  view: { x: 50, y: 250, scale: 40 },
  colour: (name) => name,
  sprites: new Sprites(1),
  textScale: 1,
  ...over,
});
