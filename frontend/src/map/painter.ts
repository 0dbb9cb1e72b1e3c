import type { Ageing } from '../domain/age';
import type { Field } from '../contract/types';
import { fieldPixels, smoothDetail } from '../domain/field';
import type { HouseHealth } from '../domain/health';
import { sensorColour, type Range } from '../domain/ramp';
import { sensorNamed } from '../domain/sensors';
import type { Tag } from '../domain/twin';
import type { TemperatureUnit } from '../domain/units';
import { drawCrosshair, drawMark, drawPulses, type Pulse } from '../draw/overlay';
import type { Palette } from '../draw/palette';
import {
  drawBlooms,
  drawLabels,
  drawPins,
  labelFont,
  labelHeight,
  labelRequests,
} from '../draw/pins';
import { PanBuffer } from '../draw/panbuffer';
import { buildScene, type Scene } from '../draw/scene';
import {
  drawBoxes,
  drawGridLabels,
  drawGridLines,
  drawGround,
  drawPicture,
  fieldPlacement,
  tintMap,
} from '../draw/still';
import {
  canvasOfPixels,
  clear,
  contextOf,
  newCanvas,
  Sprites,
  type Surface,
} from '../draw/surface';
import type { Size, View } from '../geometry/coordinates';
import type { Box } from '../geometry/clear';
import { placeLabels, type Room } from '../geometry/declutter';
import type { AppState } from '../store/app';
import { selectHealth, selectRange } from '../store/derived';
import { memoLast } from '../store/memo';
import { selectShown, selectTag, selectTags } from '../store/moment';
import type { MapPicture } from '../store/picture';

export interface Canvases {
  readonly still: HTMLCanvasElement;
  readonly pins: HTMLCanvasElement;
  readonly overlay: HTMLCanvasElement;
}

/** Fading is worked out anew this often even when nothing else changes, ms. */
const FADE_TICK_MS = 5_000;

/**
 * Puts the state on three canvases: the still layers, the pins, and what moves by itself. It
 * keeps only what is dear to make (coloured pictures, sprites, label places), each under the
 * data that it was made from.
 */
export class Painter {
  readonly #canvases: Canvases;
  #size: Size = { width: 0, height: 0 };
  #ratio = 1;
  #textScale = 1;
  #palette: Palette;
  #sprites = new Sprites(1);
  #widths = new Map<string, number>();
  // Off the page, like those of the sprites: one in the page inherits the font's features from
  // the style sheet. Made anew for another font: one off the page keeps what it first found.
  #ruler = contextOf(newCanvas(1, 1));
  /** Where labels found their places when the map last came to rest, and at which scale. */
  #room: (Room & { readonly scale: number }) | null = null;
  #lastScene: Scene | null = null;
  #paintedScene: Scene | null = null;
  readonly #stillBuffer = new PanBuffer();
  readonly #pinBuffer = new PanBuffer();

  constructor(canvases: Canvases, palette: Palette) {
    this.#canvases = canvases;
    this.#palette = palette;
  }

  /** `textScale`: how large the page's text is there, 1 as usual. */
  resize(size: Size, ratio: number, textScale = 1): void {
    // The page's sizes are fractions at times. A canvas stretched to one would blur each pixel:
    // these are whole, in pixels of the page and of the screen, and the frame cuts what is over.
    this.#size = { width: Math.ceil(size.width), height: Math.ceil(size.height) };
    this.#ratio = ratio;
    this.#textScale = textScale;
    for (const canvas of Object.values(this.#canvases) as HTMLCanvasElement[]) {
      canvas.width = Math.round(this.#size.width * ratio);
      canvas.height = Math.round(this.#size.height * ratio);
      canvas.style.width = `${canvas.width / ratio}px`;
      canvas.style.height = `${canvas.height / ratio}px`;
    }
    this.forget();
  }

  setPalette(palette: Palette): void {
    this.#palette = palette;
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

  #surface(canvas: HTMLCanvasElement): Surface {
    const surface = { context: contextOf(canvas), size: this.#size, ratio: this.#ratio };
    clear(surface);
    return surface;
  }

  /** `isNew`: more than the view changed since the last time. */
  paintStill(state: AppState, view: View, now: number, isNew: boolean): void {
    const surface = this.#surface(this.#canvases.still);
    if (isNew) this.#stillBuffer.spoil();
    this.#stillBuffer.draw(surface, view, (target, seen) => {
      this.#drawStill(target, seen, state, now);
    });
    if (state.view.layers.has('grid'))
      drawGridLabels(surface, view, this.#palette, this.#textScale);
  }

  #drawStill(surface: Surface, view: View, state: AppState, now: number): void {
    const { layers } = state.view;
    const house = selectShown(state);
    drawGround(surface, this.#palette);
    const picture = house.map.value;
    if (picture && layers.has('map')) {
      drawPicture(surface, view, this.#mapPicture(picture, this.#palette), picture.placement);
    }
    if (layers.has('grid')) drawGridLines(surface, view, this.#palette);
    if (layers.has('boxes')) drawBoxes(surface, view, this.scene(state, now).boxes, this.#palette);
    const field = house.field.value;
    const range = selectRange(state);
    if (field && range && field.sampleCount > 0 && layers.has('field')) {
      const detail = layers.has('smooth') ? smoothDetail(field) : 1;
      const coloured = this.#fieldPicture(field, range, detail);
      drawPicture(surface, view, coloured, fieldPlacement(field, coloured));
    }
  }

  /** `covered`: what stands on the map; null while the map moves, and labels with it. */
  paintPins(
    state: AppState,
    view: View,
    now: number,
    isNew: boolean,
    covered: readonly Box[] | null,
  ): void {
    const surface = this.#surface(this.#canvases.pins);
    if (covered) {
      const { width, height } = this.#size;
      this.#room = this.#roomAt(view.x, view.y, view.scale, width, height, covered);
    }
    if (isNew) this.#pinBuffer.spoil();
    this.#pinBuffer.draw(surface, view, (target, seen) => {
      this.#drawPins(target, seen, state, now);
    });
  }

  #drawPins(surface: Surface, view: View, state: AppState, now: number): void {
    const { layers } = state.view;
    const scene = this.scene(state, now);
    this.#paintedScene = scene;
    if (layers.has('blooms')) drawBlooms(surface, view, scene.blooms, this.#sprites, this.#palette);
    if (!layers.has('pins')) return;
    const colour = sensorColour(sensorNamed(state.view.sensor));
    drawPins(surface, view, scene.pins, colour, this.#sprites, this.#palette);
    if (!layers.has('labels')) return;
    const room = this.#room?.scale === view.scale ? this.#room : null;
    const labels = this.#labels(scene, view.scale, state.view.selected, this.#widths, room);
    drawLabels(surface, view, labels, this.#sprites, this.#palette, this.#textScale);
  }

  paintOverlay(
    state: AppState,
    view: View,
    moving: {
      readonly pulses: readonly Pulse[];
      readonly now: number;
      readonly crosshair: boolean;
    },
  ): void {
    const surface = this.#surface(this.#canvases.overlay);
    if (state.view.layers.has('pins')) {
      drawPulses(surface, view, moving.pulses, moving.now, this.#palette);
    }
    const { selected, hovered } = state.view;
    for (const tagId of new Set([hovered, selected])) {
      const at = tagId === null ? null : selectTag(state, tagId)?.at;
      if (at) drawMark(surface, view, at, tagId === selected, this.#palette);
    }
    if (moving.crosshair) drawCrosshair(surface, this.#palette);
  }

  /** Whether pins look otherwise by now than they were painted. */
  hasFaded(state: AppState, now: number): boolean {
    return this.scene(state, now) !== this.#paintedScene;
  }

  /** The same object as long as it looks the same. */
  scene(state: AppState, now: number): Scene {
    return this.#scene(
      selectTags(state),
      selectShown(state).ageing,
      selectHealth(state),
      state.view.sensor,
      selectRange(state),
      state.settings.unit,
      Math.floor(now / FADE_TICK_MS),
    );
  }

  readonly #scene = memoLast(
    (
      tags: readonly Tag[],
      ageing: Ageing,
      health: HouseHealth,
      sensor: string,
      range: Range | null,
      unit: TemperatureUnit,
      tick: number,
    ) => {
      const look = { tags, ageing, health, sensor: sensorNamed(sensor), range, unit };
      this.#lastScene = buildScene({ ...look, now: tick * FADE_TICK_MS }, this.#lastScene);
      return this.#lastScene;
    },
  );

  readonly #labels = memoLast(
    (
      scene: Scene,
      scale: number,
      first: string | null,
      widths: Map<string, number>,
      room: Room | null,
    ) =>
      placeLabels(
        labelRequests(scene.pins, scale, first, (text) => this.#widthOf(text, widths)),
        labelHeight(this.#textScale),
        room,
      ),
  );

  /** From pixels of the map view to those relative to the map's origin. */
  readonly #roomAt = memoLast(
    (
      x: number,
      y: number,
      scale: number,
      width: number,
      height: number,
      covered: readonly Box[],
    ): Room & { scale: number } => {
      const moved = ({ left, top, right, bottom }: Box): Box => ({
        left: left - x,
        top: top - y,
        right: right - x,
        bottom: bottom - y,
      });
      return {
        scale,
        within: moved({ left: 0, top: 0, right: width, bottom: height }),
        covered: covered.map(moved),
      };
    },
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

  readonly #mapPicture = memoLast((picture: MapPicture, palette: Palette) =>
    tintMap(picture.pixels, palette),
  );

  readonly #fieldPicture = memoLast((field: Field, range: Range, detail: number) =>
    canvasOfPixels(fieldPixels(field, sensorColour(sensorNamed(field.sensor)), range, detail)),
  );
}
