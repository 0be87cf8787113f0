/// The depth buffer that cullers ask: drawn with the picture's own vertices, samples and cells.
#pragma once

#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "client/draw/passes/DrawCalls.h"
#include "client/draw/shaders/Program.h"
#include "client/draw/store/MeshBuffers.h"
#include "client/draw/store/SharedBudget.h"
#include "client/render/cull/VisibilityDevice.h"

namespace tessera {

/// A depth buffer of its own, of at most a cell, made when first needed. Belongs to a renderer and its thread; shares
/// its meshes.
class DepthQueries : public VisibilityDevice {
public:
    /// `meshArray`: the vertex array of `meshes`.
    DepthQueries(Surface& surface, GlState& gl, MeshBuffers& meshes, SharedBudget& budget, GLuint meshArray,
                 int samples);
    ~DepthQueries() override;

    [[nodiscard]] std::vector<Part> partsOf(const ScreenCamera& screen, const PixelRect& rect) const override;
    [[nodiscard]] Expected<void> begin(const Part& part) override;
    [[nodiscard]] Expected<void> drawDepth(std::span<const DrawItem> items) override;
    [[nodiscard]] Expected<Ticket> ask(std::span<const Plate> plates, std::span<const std::uint32_t> sizes) override;
    [[nodiscard]] Expected<bool> answer(Ticket ticket) override;
    [[nodiscard]] Expected<std::span<const float>> farthest() override;

    /// Of the framebuffers.
    [[nodiscard]] std::size_t bytes() const;

private:
    [[nodiscard]] Expected<void> reach(int widthPx, int heightPx);
    [[nodiscard]] Expected<void> checkFramebuffer(GLuint framebuffer) const;
    void destroyBuffers();
    [[nodiscard]] Expected<void> useProgram(const ProgramKind& kind);
    [[nodiscard]] Expected<void> gatherSamples();

    Surface& surface_;
    GlState& gl_;
    MeshBuffers& meshes_;
    SharedBudget& budget_;
    GLuint meshArray_, plateArray_ = 0, emptyArray_ = 0;
    GLuint plateBuffer_ = 0, itemBuffer_ = 0, frameBuffer_ = 0;
    int mostSamples_, samples_;  ///< of pictures; of the part, whose camera may want fewer
    std::map<ProgramKind, Program> programs_;

    int widthPx_ = 0, heightPx_ = 0;
    GLuint depth_ = 0, depthFramebuffer_ = 0;
    GLuint farthest_ = 0, farthestFramebuffer_ = 0;  ///< where there are several samples

    std::optional<Part> part_;
    std::vector<GLuint> queries_;  ///< by ticket; more than are in use
    std::size_t asked_ = 0;
    struct Call {
        MeshRange mesh;
        bool mirrored, doubleSided;
        const DrawItem* item;
        /// Calls with the same one differ in their place alone.
        [[nodiscard]] auto state() const {
            return std::tuple(mesh.kind, mesh.pointParts, doubleSided, mirrored, mesh.firstIndex, mesh.baseVertex);
        }
    };
    std::vector<Call> calls_;
    std::vector<const DrawItem*> drawn_;
    std::vector<ItemRecord> records_;
    RecordMaker recordMaker_;
    std::vector<std::array<float, 3>> corners_;
    std::vector<float> read_;
};

}  // namespace tessera
