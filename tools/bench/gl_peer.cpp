#include "gl_peer.h"

#define GL_GLEXT_PROTOTYPES 1
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace kiln::bench {
namespace {

constexpr const char* kVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position;
uniform mat4 view;
void main() { gl_Position = view * vec4(position, 1.0); }
)";
constexpr const char* kFragmentShader = R"(#version 330 core
layout(location = 0) out uint id;
void main() { id = uint(gl_PrimitiveID) + 1u; }
)";

GLuint shader(GLenum kind, const char* text) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint is_compiled = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &is_compiled);
  if (is_compiled == 0) throw std::runtime_error("a shader did not compile");
  return shader;
}

}  // namespace

struct GlPeer::Impl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  std::uint32_t size = 0;
  GLsizei indices = 0;
  GLint view_location = -1;
};

GlPeer::GlPeer(std::span<const Vec3> positions, std::span<const Triangle> triangles,
               std::uint32_t size)
    : impl_(std::make_unique<Impl>()) {
  Impl& impl = *impl_;
  impl.size = size;
  impl.indices = static_cast<GLsizei>(triangles.size() * 3);
  const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_display == nullptr) throw std::runtime_error("EGL has no platform displays");
  impl.display = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  if (impl.display == EGL_NO_DISPLAY || eglInitialize(impl.display, nullptr, nullptr) == 0) {
    throw std::runtime_error("EGL has no surfaceless display");
  }
  eglBindAPI(EGL_OPENGL_API);
  const std::array<EGLint, 3> wanted = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  eglChooseConfig(impl.display, wanted.data(), &config, 1, &count);
  const std::array<EGLint, 7> version = {EGL_CONTEXT_MAJOR_VERSION,
                                         3,
                                         EGL_CONTEXT_MINOR_VERSION,
                                         3,
                                         EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                         EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                         EGL_NONE};
  impl.context = eglCreateContext(impl.display, config, EGL_NO_CONTEXT, version.data());
  if (impl.context == EGL_NO_CONTEXT ||
      eglMakeCurrent(impl.display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl.context) == 0) {
    throw std::runtime_error("EGL gives no OpenGL 3.3 context");
  }

  const GLuint program = glCreateProgram();
  glAttachShader(program, shader(GL_VERTEX_SHADER, kVertexShader));
  glAttachShader(program, shader(GL_FRAGMENT_SHADER, kFragmentShader));
  glLinkProgram(program);
  glUseProgram(program);
  impl.view_location = glGetUniformLocation(program, "view");

  std::array<GLuint, 2> buffers{};
  GLuint array = 0;
  glGenVertexArrays(1, &array);
  glBindVertexArray(array);
  glGenBuffers(2, buffers.data());
  glBindBuffer(GL_ARRAY_BUFFER, buffers[0]);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(positions.size_bytes()), positions.data(),
               GL_STATIC_DRAW);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  glEnableVertexAttribArray(0);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[1]);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(triangles.size_bytes()),
               triangles.data(), GL_STATIC_DRAW);

  std::array<GLuint, 2> targets{};
  GLuint frame = 0;
  glGenRenderbuffers(2, targets.data());
  const auto side = static_cast<GLsizei>(size);
  glBindRenderbuffer(GL_RENDERBUFFER, targets[0]);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_R32UI, side, side);
  glBindRenderbuffer(GL_RENDERBUFFER, targets[1]);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, side, side);
  glGenFramebuffers(1, &frame);
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, targets[0]);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, targets[1]);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("OpenGL cannot draw to unsigned integers");
  }
  glViewport(0, 0, side, side);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glEnable(GL_CULL_FACE);
  glFrontFace(GL_CCW);
}

GlPeer::~GlPeer() {
  if (impl_ == nullptr || impl_->display == EGL_NO_DISPLAY) return;
  eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(impl_->display, impl_->context);
  eglTerminate(impl_->display);
}
GlPeer::GlPeer(GlPeer&&) noexcept = default;

std::string GlPeer::renderer() const {
  return reinterpret_cast<const char*>(glGetString(GL_RENDERER));
}

void GlPeer::draw(const std::vector<kiln_view>& views) {
  for (const kiln_view& view : views) {
    // Converts pixels to clip space: x' = 2 x / size - 1. The depth 1 - dot(toward, p) in [0.5, 1.5] becomes [-1, 1].
    const float s = 2 * view.scale / static_cast<float>(view.width);
    const float x0 = 2 * view.left / static_cast<float>(view.width) - 1;
    const float y0 = 1 - 2 * view.top / static_cast<float>(view.height);
    const std::array<float, 16> matrix = {s * view.right[0],
                                          s * view.up[0],
                                          -2 * view.toward[0],
                                          0,
                                          s * view.right[1],
                                          s * view.up[1],
                                          -2 * view.toward[1],
                                          0,
                                          s * view.right[2],
                                          s * view.up[2],
                                          -2 * view.toward[2],
                                          0,
                                          x0,
                                          y0,
                                          0,
                                          1};
    glUniformMatrix4fv(impl_->view_location, 1, GL_FALSE, matrix.data());
    const std::array<GLuint, 4> nothing{};
    const float far = 1;
    glClearBufferuiv(GL_COLOR, 0, nothing.data());
    glClearBufferfv(GL_DEPTH, 0, &far);
    glDrawElements(GL_TRIANGLES, impl_->indices, GL_UNSIGNED_INT, nullptr);
  }
  glFinish();
}

std::vector<std::uint32_t> GlPeer::ids() const {
  const std::uint32_t size = impl_->size;
  std::vector<std::uint32_t> pixels(std::size_t{size} * size);
  glReadPixels(0, 0, static_cast<GLsizei>(size), static_cast<GLsizei>(size), GL_RED_INTEGER,
               GL_UNSIGNED_INT, pixels.data());
  std::vector<std::uint32_t> rows(pixels.size());
  for (std::uint32_t y = 0; y < size; ++y) {
    std::copy_n(&pixels[std::size_t{size - 1 - y} * size], size, &rows[std::size_t{y} * size]);
  }
  return rows;
}

}  // namespace kiln::bench
