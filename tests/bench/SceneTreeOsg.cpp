/// The tree in OpenSceneGraph, as one who knows it would build it. A program of its own: libosg brings libGL, which
/// must not meet OSMesa in one process.
///
///     bench_scene_osg PLACES
#include <osg/MatrixTransform>
#include <osg/NodeVisitor>

#include <cstdlib>
#include <vector>

#include "tests/bench/SceneSide.h"
#include "tests/bench/SceneTree.h"

namespace tessera::bench {
namespace {

void toMatrix(const TreePlace& place, osg::Matrixd& matrix) {
    matrix.makeRotate(osg::Quat(place.rotation[1], place.rotation[2], place.rotation[3], place.rotation[0]));
    matrix.preMultScale(osg::Vec3d(place.scale[0], place.scale[1], place.scale[2]));
    matrix.setTrans(place.translation[0], place.translation[1], place.translation[2]);
}

double sumOf(const osg::Matrixd& world) {
    return world(3, 0) + world(3, 1) + world(3, 2);
}

/// Accumulates matrices as a CullVisitor does, without what culling costs besides.
class WorldVisitor : public osg::NodeVisitor {
public:
    WorldVisitor() : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN) { stack_.resize(1); }
    void apply(osg::MatrixTransform& node) override {
        stack_.emplace_back(stack_.back());
        stack_.back().preMult(node.getMatrix());
        sum += sumOf(stack_.back());
        traverse(node);
        stack_.pop_back();
    }

    double sum = 0;

private:
    std::vector<osg::Matrixd> stack_;
};

class OsgTree : public TreeSide {
public:
    explicit OsgTree(std::uint64_t count)
        : places_(treePlaces(count)), changed_{changedPlaces(count, 1), changedPlaces(count, 2)} {
        nodes_.resize(changed_[0].size());
    }

    void clear() override { root_ = nullptr; }

    void build() override {
        // A node holds its children by reference; nobody needs more than a list of what will be edited.
        std::vector<osg::MatrixTransform*> all(places_.size());
        osg::Matrixd matrix;
        for (std::size_t i = 0; i < places_.size(); ++i) {
            toMatrix(places_[i], matrix);
            all[i] = new osg::MatrixTransform(matrix);
            if (i == 0)
                root_ = all[i];
            else
                all[parentOf(i)]->addChild(all[i]);
        }
        for (std::size_t k = 0; k < nodes_.size(); ++k) nodes_[k] = all[changedPlace(k)];
    }

    double traverse() override {
        WorldVisitor visitor;
        root_->accept(visitor);
        return visitor.sum;
    }

    void change() override {
        const std::vector<TreePlace>& to = changed_[turn_++ & 1];
        osg::Matrixd matrix;
        for (std::size_t k = 0; k < nodes_.size(); ++k) {
            toMatrix(to[k], matrix);
            nodes_[k]->setMatrix(matrix);
        }
    }

    double look() override {
        double sum = 0;
        for (osg::MatrixTransform* node : nodes_) {
            osg::Matrixd world = node->getMatrix();
            for (const osg::Node* at = node; at->getNumParents() > 0;) {
                at = at->getParent(0);
                world.postMult(static_cast<const osg::MatrixTransform*>(at)->getMatrix());
            }
            sum += sumOf(world);
        }
        return sum;
    }

    double changeKept() override { return 0; }

private:
    std::vector<TreePlace> places_, changed_[2];
    std::vector<osg::MatrixTransform*> nodes_;
    osg::ref_ptr<osg::MatrixTransform> root_;
    unsigned turn_ = 0;
};

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: bench_scene_osg PLACES\n");
        return 2;
    }
    tessera::bench::OsgTree tree(std::strtoull(argv[1], nullptr, 10));
    return tessera::bench::serveTree(tree);
}
