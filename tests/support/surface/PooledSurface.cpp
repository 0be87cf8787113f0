#include "tests/support/surface/PooledSurface.h"

#include <utility>
#include <vector>

namespace tessera::test {
namespace {

thread_local bool poolIsGone = false;  // as static objects end after it
struct Pool {
    ~Pool() { poolIsGone = true; }
    std::vector<std::unique_ptr<Surface>> free;
};
thread_local Pool pool;

class PooledSurface final : public Surface {
public:
    explicit PooledSurface(std::unique_ptr<Surface> surface) : surface_(std::move(surface)) {}
    ~PooledSurface() override {
        if (!poolIsGone) pool.free.push_back(std::move(surface_));
    }
    [[nodiscard]] Expected<void> makeCurrent() override { return surface_->makeCurrent(); }
    [[nodiscard]] void* procAddress(const char* name) const override { return surface_->procAddress(name); }
    [[nodiscard]] std::string description() const override { return surface_->description(); }

private:
    std::unique_ptr<Surface> surface_;
};

}  // namespace

std::unique_ptr<Surface> pooledSurface() {
    if (pool.free.empty()) return std::make_unique<PooledSurface>(makeSurface("osmesa").value());
    std::unique_ptr<Surface> again = std::move(pool.free.back());
    pool.free.pop_back();
    return std::make_unique<PooledSurface>(std::move(again));
}

}  // namespace tessera::test
