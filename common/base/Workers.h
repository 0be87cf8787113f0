/// A few threads for work that is cut into tasks beforehand.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace tessera {

/// Runs tasks on the calling thread and on `threads - 1` others. Which thread runs which task is not said: results must
/// not depend on it (cut the work by its size, never by the number of threads, and join results by task). Used from one
/// thread at a time.
class Workers {
public:
    explicit Workers(unsigned threads);
    ~Workers();
    Workers(const Workers&) = delete;
    Workers& operator=(const Workers&) = delete;

    [[nodiscard]] unsigned threads() const;
    /// Calls task(0) … task(count - 1), each once, and returns when all have returned. Tasks must not throw.
    void run(std::size_t count, const std::function<void(std::size_t)>& task);

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace tessera
