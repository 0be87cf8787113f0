#include "client/window/StereoWindow.h"

#include <SDL2/SDL.h>
#include <SDL2/SDL_opengl.h>
#include <fmt/format.h>

namespace tessera {

/// What OpenGL 1.1 has is enough: pixels are laid into both back buffers.
struct StereoWindow::Impl {
    SDL_Window* window = nullptr;
    SDL_GLContext context = nullptr;
    void(APIENTRY* clear)(GLbitfield) = nullptr;
    void(APIENTRY* drawBuffer)(GLenum) = nullptr;
    void(APIENTRY* getBooleanv)(GLenum, GLboolean*) = nullptr;
    void(APIENTRY* pixelStorei)(GLenum, GLint) = nullptr;
    void(APIENTRY* pixelZoom)(GLfloat, GLfloat) = nullptr;
    void(APIENTRY* rasterPos2f)(GLfloat, GLfloat) = nullptr;
    void(APIENTRY* viewport)(GLint, GLint, GLsizei, GLsizei) = nullptr;
    void(APIENTRY* drawPixels)(GLsizei, GLsizei, GLenum, GLenum, const void*) = nullptr;

    ~Impl() {
        if (context) SDL_GL_DeleteContext(context);
        if (window) SDL_DestroyWindow(window);
    }
    bool load() {
        const auto find = [](auto& function, const char* name) {
            function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(SDL_GL_GetProcAddress(name));
            return function != nullptr;
        };
        return find(clear, "glClear") && find(drawBuffer, "glDrawBuffer") && find(getBooleanv, "glGetBooleanv") &&
               find(pixelStorei, "glPixelStorei") && find(pixelZoom, "glPixelZoom") &&
               find(rasterPos2f, "glRasterPos2f") && find(viewport, "glViewport") && find(drawPixels, "glDrawPixels");
    }
};

StereoWindow::StereoWindow(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StereoWindow::~StereoWindow() = default;

std::unique_ptr<StereoWindow> StereoWindow::open(const std::string& title, const DesktopRect& place, bool fullScreen) {
    auto impl = std::make_unique<Impl>();
    SDL_GL_SetAttribute(SDL_GL_STEREO, 1);
    SDL_GL_SetAttribute(SDL_GL_DOUBLEBUFFER, 1);
    const Uint32 flags = SDL_WINDOW_OPENGL | SDL_WINDOW_BORDERLESS |
                         (fullScreen ? static_cast<Uint32>(SDL_WINDOW_FULLSCREEN_DESKTOP) : 0u);
    impl->window = SDL_CreateWindow(title.c_str(), place.x, place.y, place.width, place.height, flags);
    if (impl->window) impl->context = SDL_GL_CreateContext(impl->window);
    GLboolean stereo = GL_FALSE;
    if (impl->context && impl->load()) impl->getBooleanv(GL_STEREO, &stereo);
    SDL_GL_ResetAttributes();
    if (stereo) {
        if (fullScreen) SDL_ShowCursor(SDL_DISABLE);
        SDL_GL_SetSwapInterval(1);
        return std::unique_ptr<StereoWindow>(new StereoWindow(std::move(impl)));
    }
    fmt::print(stderr,
               "tessera-window: the graphics driver shows no two eyes (QUAD_BUFFERED): the left one is shown\n");
    return nullptr;
}

Expected<void> StereoWindow::show(const std::uint8_t* rgbx, int eyeWidthPx, int heightPx) {
    int width = 0, height = 0;
    SDL_GL_GetDrawableSize(impl_->window, &width, &height);
    impl_->viewport(0, 0, width, height);
    impl_->pixelStorei(GL_UNPACK_ROW_LENGTH, 2 * eyeWidthPx);
    for (int eye = 0; eye < 2; ++eye) {
        impl_->drawBuffer(eye == 0 ? GL_BACK_LEFT : GL_BACK_RIGHT);
        impl_->clear(GL_COLOR_BUFFER_BIT);
        if (!rgbx) continue;
        impl_->rasterPos2f(-1, 1);
        impl_->pixelZoom(static_cast<float>(width) / static_cast<float>(eyeWidthPx),
                         -static_cast<float>(height) / static_cast<float>(heightPx));
        impl_->drawPixels(eyeWidthPx, heightPx, GL_RGBA, GL_UNSIGNED_BYTE,
                          rgbx + std::size_t{4} * static_cast<std::size_t>(eye * eyeWidthPx));
    }
    SDL_GL_SwapWindow(impl_->window);
    return {};
}

}  // namespace tessera
