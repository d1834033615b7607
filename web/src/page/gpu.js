// The graphics card: a renderer, textures of numbers, and passes over a whole picture.

import {
  BufferAttribute, BufferGeometry, Camera, DataTexture, FloatType, GLSL3, HalfFloatType, IntType,
  LinearSRGBColorSpace, Mesh, NearestFilter, RawShaderMaterial, RedFormat, RedIntegerFormat,
  RGBAFormat, RGFormat, Scene, WebGLRenderer, WebGLRenderTarget,
} from "three";

export const HEAD = `precision highp float;
precision highp int;
precision highp sampler2D;
precision highp isampler2D;
precision highp usampler2D;
`;
const FORMATS = {
  four: [RGBAFormat, FloatType], two: [RGFormat, FloatType], one: [RedFormat, FloatType],
  whole: [RedIntegerFormat, IntType, "R32I"],
};
const FULL = `${HEAD}in vec3 position;
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;

/** What this page cannot do without. */
export class NoGraphics extends Error {}

export class Gpu {
  constructor(canvas) {
    const context = canvas.getContext("webgl2", {
      alpha: false, antialias: false, depth: false, powerPreference: "high-performance",
    });
    if (!context) {
      throw new NoGraphics("this browser gives the page no WebGL 2, so there are no pictures");
    }
    this.gl = context;
    this.exact = Boolean(context.getExtension("EXT_color_buffer_float"));
    if (!this.exact && !context.getExtension("EXT_color_buffer_half_float")) {
      throw new NoGraphics("this graphics card cannot draw into textures of floats");
    }
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.autoClear = false;
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.setClearColor(0, 0);
    this.renderer.debug.onShaderError = (gl, program, vertex, fragment) => {
      this.fault = gl.getShaderInfoLog(fragment) || gl.getProgramInfoLog(program) || "unknown";
    };
    this.camera = new Camera();
    this.fault = "";
  }

  /** The largest texture that there may be. */
  get widest() {
    return this.gl.getParameter(this.gl.MAX_TEXTURE_SIZE);
  }

  /** What the graphics card is called. */
  get name() {
    const known = this.gl.getExtension("WEBGL_debug_renderer_info");
    return this.gl.getParameter(known ? known.UNMASKED_RENDERER_WEBGL : this.gl.RENDERER);
  }

  /** A texture of numbers as the networks read them. */
  texture({ format, width, height, data }) {
    const [layout, type, internal] = FORMATS[format];
    const texture = new DataTexture(data, width, height, layout, type);
    texture.internalFormat = internal ?? null;
    texture.unpackAlignment = 4;
    texture.minFilter = texture.magFilter = NearestFilter;
    texture.generateMipmaps = false;
    texture.needsUpdate = true;
    return texture;
  }

  /** Uniforms for the textures of a lamp's networks. */
  uniforms(textures) {
    return Object.fromEntries(
      textures.map((texture) => [`pl_${texture.format}s`, { value: this.texture(texture) }]),
    );
  }

  /** A picture of floats to draw into, with `count` layers. */
  target(width, height, { count = 1, exact = this.exact } = {}) {
    return new WebGLRenderTarget(width, height, {
      count, depthBuffer: false, format: RGBAFormat, type: exact ? FloatType : HalfFloatType,
      minFilter: NearestFilter, magFilter: NearestFilter, generateMipmaps: false,
    });
  }

  /** A target of two layers of a size: this one if it fits. */
  resized(target, [width, height]) {
    if (target?.width === width && target?.height === height) {
      return target;
    }
    target?.dispose();
    return this.target(width, height, { count: 2 });
  }

  /** A material of our own shaders. */
  material(vertexShader, fragmentShader, uniforms, options = {}) {
    return new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader, fragmentShader, uniforms, ...options,
    });
  }

  /** A pass over all pixels. */
  pass(fragmentShader, uniforms) {
    const geometry = new BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    geometry.setAttribute("position", new BufferAttribute(corners, 3));
    const options = { depthTest: false, depthWrite: false };
    const mesh = new Mesh(geometry, this.material(FULL, HEAD + fragmentShader, uniforms, options));
    mesh.frustumCulled = false;
    const scene = new Scene();
    scene.add(mesh);
    return { scene, uniforms: mesh.material.uniforms, material: mesh.material };
  }

  /** Draws a scene into a target, or onto the page; `part` bounds it to [x, y, width, height]. */
  draw(scene, camera, target = null, part = null) {
    if (target) {
      target.scissorTest = part !== null;
      target.scissor.set(...(part ?? [0, 0, target.width, target.height]));
    }
    this.renderer.setRenderTarget(target);
    this.renderer.render(scene, camera ?? this.camera);
  }

  clear(target) {
    target.scissorTest = false;
    this.renderer.setRenderTarget(target);
    this.renderer.clear();
  }

  /** Compiles a scene's shaders, if possible while the page goes on; whether that worked. */
  async compile(scene) {
    this.fault = "";
    if (this.gl.getExtension("KHR_parallel_shader_compile")) {
      await this.renderer.compileAsync(scene, this.camera);
    } else {
      this.renderer.compile(scene, this.camera);
    }
    scene.traverse(({ material }) => {
      if (material) {
        this.renderer.properties.get(material).currentProgram.getUniforms(); // Looks for faults.
      }
    });
    return !this.fault;
  }

  /** Waits until all that was asked for is drawn. */
  async finish() {
    const { gl } = this;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    while (fence && gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) {
      if (gl.isContextLost()) {
        break;
      }
      await soon();
    }
    gl.deleteSync(fence);
  }
}

/** Lets the page do other things, as shortly as it can. */
function soon() {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      port1.close();
      resolve();
    };
    port2.postMessage(null);
  });
}

/** Frees what a scene holds on the graphics card. */
export function dispose(scene) {
  scene.traverse((object) => {
    object.geometry?.dispose();
    if (object.material) {
      for (const { value } of Object.values(object.material.uniforms ?? {})) {
        value?.isTexture && value.dispose();
      }
      object.material.dispose();
    }
  });
}
