import type { Field } from '../contract/types';
import { divergingShade } from '../domain/difference';
import { edgesOf, errorShade, fieldPixels } from '../domain/field';
import { fieldShade } from '../domain/ramp';
import { cellsWhere, idealShade, withOld } from '../domain/ideal';
import type { Sensor } from '../domain/sensors';
import { equal } from '../domain/twin';
import {
  drawBlooms,
  drawCrosshair,
  drawLabels,
  drawMark,
  drawPins,
  labelFont,
  labelHeight,
  labelRequests,
} from '../draw/pins';
import { coloursOf, type Colours } from '../draw/colours';
import {
  canvasOfPixels,
  clear,
  contextOf,
  newCanvas,
  PanBuffer,
  type Pen,
  Sprites,
} from '../draw/surface';
import { buildScene, type Scene, type SceneInput } from '../draw/scene';
import {
  cellsOf,
  drawAreas,
  drawBoxes,
  drawEdges,
  drawGridLabels,
  drawGridLines,
  drawGround,
  drawPicture,
  floorOf,
  hatchedOf,
  Hatching,
  knownOf,
  placedField,
  tintMap,
} from '../draw/still';
import type { Box, Size, View } from '../geometry/coordinates';
import { placeLabels, type Room } from '../geometry/clear';
import type { AppState } from '../store/app';
import {
  selectAreas,
  selectHealth,
  selectHeat,
  selectListed,
  selectMapped,
  selectSensor,
  type Heat,
} from '../store/derived';
import { retainEqual, memoLast, memoOne } from '../domain/memo';
import { selectShown, selectTag, selectTags, shownTime } from '../store/moment';
import type { MapPicture } from '../geometry/image';

export type Canvases = Readonly<Record<'still' | 'pins' | 'overlay', HTMLCanvasElement>>;

/** Fading is recomputed this often, seconds, even if nothing else changes. */
const FADE_TICK_S = 5;

const edges = memoOne(edgesOf);
const knownPart = memoOne(knownOf);
const hatched = memoLast(hatchedOf);
const floor = memoOne(({ pixels }: MapPicture) => floorOf(pixels));
/** The cells of a field that are not too old. */
const holding = memoLast((field: Field, old: Uint8Array | null) =>
  old ? cellsWhere(field, (cell) => old[cell] === 0) : field,
);
const whole = memoOne((field: Field) => cellsOf(field, () => true));

interface RoomAt extends Room {
  readonly scale: number;
}

/**
 * Draws the state on three canvases: still layers, pins, and the pointer's marks. It caches only what is
 * expensive (coloured pictures, sprites, label places), each by its input data.
 */
export class Painter {
  #size: Size = { width: 0, height: 0 };
  #ratio = 1;
  #textScale = 1;
  #sprites = new Sprites(1);
  #widths = new Map<string, number>();
  // Off the page, like the sprites' canvases: one in the page would inherit the font's features from
  // the style sheet. Recreated for another font: one off the page keeps the first font it found.
  #ruler = contextOf(newCanvas(1, 1));
  /** Label places from when the map last came to rest, with their scale. */
  #room: RoomAt | null = null;
  readonly #retainedRoom = retainEqual<RoomAt>(equal);
  #paintedScene: Scene | null = null;
  readonly #hatching = new Hatching();
  readonly #stillBuffer = new PanBuffer();
  readonly #pinBuffer = new PanBuffer();

  /** A new object when colours change. */
  #colour: Colours;

  constructor(private readonly canvases: Canvases) {
    this.#colour = coloursOf(canvases.still);
  }

  /** `textScale`: scale of the page's text, usually 1. */
  resize(size: Size, ratio: number, textScale = 1): void {
    // Layout sizes may be fractional, and a canvas stretched to one would blur. So canvas sizes are
    // whole, in CSS and device pixels, and the frame clips the excess.
    this.#size = { width: Math.ceil(size.width), height: Math.ceil(size.height) };
    this.#ratio = ratio;
    this.#textScale = textScale;
    for (const canvas of Object.values(this.canvases)) {
      canvas.width = Math.round(this.#size.width * ratio);
      canvas.height = Math.round(this.#size.height * ratio);
      canvas.style.width = `${canvas.width / ratio}px`;
      canvas.style.height = `${canvas.height / ratio}px`;
    }
    this.forget();
  }

  recolour(): void {
    this.#colour = coloursOf(this.canvases.still);
    this.forget();
  }

  /** Drops sprites and text widths: the theme, the pixel ratio or the font has changed. */
  forget(): void {
    this.#stillBuffer.spoil();
    this.#pinBuffer.spoil();
    this.#sprites = new Sprites(this.#ratio);
    this.#widths = new Map();
    this.#ruler = contextOf(newCanvas(1, 1));
  }

  #penOn(canvas: HTMLCanvasElement, view: View): Pen {
    const pen = {
      ...{ context: contextOf(canvas), size: this.#size, ratio: this.#ratio, view },
      ...{ colour: this.#colour, sprites: this.#sprites, textScale: this.#textScale },
    };
    clear(pen);
    return pen;
  }

  /** `isNew`: more than the view has changed. */
  paintStill(state: AppState, view: View, now: number, isNew: boolean): void {
    const pen = this.#penOn(this.canvases.still, view);
    if (isNew) this.#stillBuffer.spoil();
    this.#stillBuffer.draw(pen, (target) => {
      this.#drawStill(target, state, now);
    });
    if (state.view.layers.has('grid')) drawGridLabels(pen);
  }

  #drawStill(pen: Pen, state: AppState, now: number): void {
    const { layers } = state.view;
    const house = selectShown(state);
    drawGround(pen);
    const picture = house.map.value;
    if (picture && layers.has('map')) {
      const { placement } = picture;
      drawPicture(pen, { picture: this.#mapPicture(picture, this.#colour), placement });
    }
    const isUnknownMarked = layers.has('field') && layers.has('unknown');
    const mapped = isUnknownMarked ? selectMapped(state) : null;
    if (mapped) this.#drawUnknown(pen, mapped, picture);
    if (layers.has('grid')) drawGridLines(pen);
    if (layers.has('boxes')) drawBoxes(pen, this.scene(state, now).boxes);
    const heat = selectHeat(state);
    if (heat && layers.has('field')) {
      const coloured = this.#heatPicture(heat, selectSensor(state), isUnknownMarked);
      drawPicture(pen, placedField(heat.field, coloured), true);
      if (isUnknownMarked && !heat.isError) {
        for (const { cells, gap } of hatched(heat.field, heat.old)) {
          this.#hatching.draw(pen, placedField(heat.field, cells), null, gap);
        }
      }
      if (isUnknownMarked) drawEdges(pen, edges(holding(heat.field, heat.old)));
    }
    drawAreas(pen, selectAreas(state));
  }

  /** The greenhouse's inside: the floor of its map; without one, the field's extent. */
  #drawUnknown(pen: Pen, field: Field, map: MapPicture | null): void {
    const inside = map
      ? { picture: floor(map), placement: map.placement }
      : placedField(field, whole(field));
    this.#hatching.draw(pen, inside, placedField(field, knownPart(field)));
  }

  /**
   * `covered`: elements over the map; null while the map moves, and labels with it. `marks`: of the
   * robot and of suggested tags, relative to the map's origin.
   */
  paintPins(
    state: AppState,
    view: View,
    now: number,
    isNew: boolean,
    covered: readonly Box[] | null,
    marks: readonly Box[] = [],
  ): void {
    const pen = this.#penOn(this.canvases.pins, view);
    if (covered) {
      const { width, height } = this.#size;
      // Pixels relative to the map's origin.
      const moved = ({ left, top, right, bottom }: Box): Box => ({
        ...{ left: left - view.x, right: right - view.x },
        ...{ top: top - view.y, bottom: bottom - view.y },
      });
      this.#room = this.#retainedRoom({
        scale: view.scale,
        within: moved({ left: 0, top: 0, right: width, bottom: height }),
        covered: covered.map(moved),
        marks,
      });
    }
    if (isNew) this.#pinBuffer.spoil();
    this.#pinBuffer.draw(pen, (target) => {
      this.#drawPins(target, state, now);
    });
  }

  #drawPins(pen: Pen, state: AppState, now: number): void {
    const { layers } = state.view;
    const scene = this.scene(state, now);
    this.#paintedScene = scene;
    if (layers.has('blooms')) drawBlooms(pen, scene.blooms);
    if (!layers.has('pins')) return;
    drawPins(pen, scene.pins, scene.spacing);
    if (!layers.has('labels')) return;
    const { scale } = pen.view;
    const room = this.#room?.scale === scale ? this.#room : null;
    drawLabels(pen, this.#labels(scene, scale, state.view.selected, this.#widths, room));
  }

  paintOverlay(state: AppState, view: View, hasCrosshair: boolean): void {
    const pen = this.#penOn(this.canvases.overlay, view);
    const { selected, hovered } = state.view;
    for (const tagId of new Set([hovered, selected])) {
      const at = tagId === null ? null : selectTag(state, tagId)?.at;
      if (at) drawMark(pen, at, tagId === selected);
    }
    if (hasCrosshair) drawCrosshair(pen);
  }

  hasFaded(state: AppState, now: number): boolean {
    return this.scene(state, now) !== this.#paintedScene;
  }

  scene(state: AppState, now: number): Scene {
    const at = shownTime(state, now);
    return this.#scene(
      this.#sceneInput({
        tags: selectTags(state),
        health: selectHealth(state),
        sensor: selectSensor(state),
        listed: selectListed(state),
        now: at && Math.floor(at / FADE_TICK_S) * FADE_TICK_S,
      }),
    );
  }

  readonly #sceneInput = retainEqual<SceneInput>();
  /** The same object if nothing looks different, so that labels stay in place. */
  readonly #retainedScene = retainEqual<Scene>(equal);
  readonly #scene = memoOne((input: SceneInput) => this.#retainedScene(buildScene(input)));

  readonly #labels = memoLast(
    (
      scene: Scene,
      scale: number,
      first: string | null,
      widths: Map<string, number>,
      room: Room | null,
    ) =>
      placeLabels(
        labelRequests(scene, scale, first, (text) => this.#widthOf(text, widths)),
        labelHeight(this.#textScale),
        room,
      ),
  );

  #widthOf(text: string, widths: Map<string, number>): number {
    const known = widths.get(text);
    if (known !== undefined) return known;
    if (widths.size > 5_000) widths.clear();
    this.#ruler.font = labelFont(this.#textScale);
    const width = Math.ceil(this.#ruler.measureText(text).width);
    widths.set(text, width);
    return width;
  }

  readonly #mapPicture = memoLast((picture: MapPicture, colour: Colours) =>
    tintMap(picture.pixels, colour),
  );

  readonly #heatPicture = memoLast(
    (
      { field, range, zones, difference, isError, old }: Heat,
      sensor: Sensor,
      isUnknownMarked: boolean,
    ) => {
      const shade = difference
        ? divergingShade(range)
        : isError
          ? errorShade(range)
          : zones
            ? idealShade(zones)
            : fieldShade(sensor, range);
      return canvasOfPixels(fieldPixels(field, old ? withOld(shade, old, isUnknownMarked) : shade));
    },
  );
}
