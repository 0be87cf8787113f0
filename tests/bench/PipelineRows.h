/// Who measures which rows of the pipeline's benchmark.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "server/collision/mesh/TriangleMesh.h"
#include "tests/bench/CollisionTable.h"

namespace tessera {

struct PipelineOptions {
    int passes = 4;
    bool quick = false;          ///< fewer bodies, fewer frames: to see that all works
    std::set<std::string> only;  ///< groups of rows; empty: all
    std::string plant, parts;    ///< a folder of models that stay; a model whose parts move
    /// By name alone: what takes an hour.
    [[nodiscard]] bool asksFor(const std::string& group) const { return only.count(group) > 0; }
    [[nodiscard]] bool wants(const std::string& group) const { return only.empty() || only.count(group) > 0; }
};

/// Convex bodies that fly and now and then touch: beside Bullet's collision world.
void convexRows(const PipelineOptions& options, CollisionTable& table);
/// Parts of an engine that swing in and out of a plant's surfaces: beside the same loop over FCL.
void plantRows(const PipelineOptions& options, CollisionTable& table);
/// Ten times more that stands still: beside ourselves.
void restRows(const PipelineOptions& options, CollisionTable& table);
/// Ten thousand that rest in touch and are of interest to each other, at rest and with one that moves: beside a
/// hundred.
void touchRows(const PipelineOptions& options, CollisionTable& table);
/// Objects with an interest each, at rest and on their way, and one edit of each kind: beside a tenth of them.
void interestRows(const PipelineOptions& options, CollisionTable& table);
/// Ten balls that deform in a plant, timed within the frame: beside the same ten in a hall of a thousandth of the
/// faces. A cloth of which one row of vertices moves: beside one that moves as a whole.
void deformRows(const PipelineOptions& options, CollisionTable& table);
/// Free bodies poured into a bin, a thousand and, where it is asked for, ten thousand: beside Bullet's dynamics world.
void pourRows(const PipelineOptions& options, CollisionTable& table);

/// A shipped scene of free bodies (pour-1000, pour-10000): beside Bullet's dynamics world.
void fileRows(const std::string& name, const PipelineOptions& options, CollisionTable& table);
/// One awake body among sleepers: a hundred times more of them; beside Bullet's dynamics world.
void sleepRows(const PipelineOptions& options, CollisionTable& table);
/// Distance, realigned k-DOPs, threads and memory of two pairs of models.
void pairRows(const PipelineOptions& options, CollisionTable& table);

/// The models of a plant, but for lamps and the backdrop, which belong to the picture that it was made for.
[[nodiscard]] Expected<std::vector<TriangleMesh>> readPlant(const std::filesystem::path& folder);

}  // namespace tessera
