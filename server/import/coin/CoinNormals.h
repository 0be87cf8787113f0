/// Normals of shapes of which Coin would make none in time.
#pragma once

#include <Inventor/actions/SoCallbackAction.h>

#include <optional>
#include <vector>

class SoNode;
class SoVRMLIndexedFaceSet;

namespace tessera {

/// Coin compares each two faces that meet in one point. Where these are too many pairs, one normal stands for all while
/// this is there, and who takes the triangles makes their normals (setSmoothNormals). So it is done by the
/// `creaseAngle` of the shape. Nothing: Coin's are good.
class PlainNormals {
public:
    /// Of VRML 2, when its numbers have been mended. Afterwards the node is as it was.
    explicit PlainNormals(SoNode& geometry);
    /// Of Inventor and VRML 1; changes the action's state, which the caller gives back.
    PlainNormals(SoNode& shape, const SoCallbackAction& action);
    ~PlainNormals();
    PlainNormals(const PlainNormals&) = delete;
    PlainNormals& operator=(const PlainNormals&) = delete;

    [[nodiscard]] std::optional<double> creaseAngle() const { return creaseAngle_; }

private:
    std::optional<double> creaseAngle_;
    SoVRMLIndexedFaceSet* changed_ = nullptr;
    SoNode* normal_ = nullptr;
    std::vector<int> index_;
    bool eachVertex_ = true;
};

}  // namespace tessera
