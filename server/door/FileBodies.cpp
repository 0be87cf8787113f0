#include "server/door/FileBodies.h"

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/error.hpp>

#include <cerrno>

#include "server/door/DoorStream.h"
#include "server/door/Routes.h"

namespace tessera {
namespace {

namespace beast = boost::beast;

constexpr std::size_t kPiece = std::size_t{256} << 10;

/// To close a large file, or to remove it, takes its time.
template <typename File>
void letGo(const std::weak_ptr<Beside>& disk, std::shared_ptr<File> file) {
    const std::shared_ptr<Beside> held = disk.lock();
    if (held) held->run([file = std::move(file)]() mutable { return file.reset(), true; }, [](bool) {});
}

class Receiving : public std::enable_shared_from_this<Receiving> {
public:
    using Outcome = tl::expected<std::string, HttpAnswer>;
    using Then = std::function<void(const Outcome&)>;
    Receiving(std::shared_ptr<Guest> guest, DoorStream& stream, DoorContext& context,
              std::shared_ptr<UploadFolder::Incoming> file, std::uint64_t length, Then then)
        : guest_(std::move(guest)),
          stream_(stream),
          context_(context),
          disk_(context.disk),
          file_(std::move(file)),
          patience_(context.io),
          left_(length),
          then_(std::move(then)) {}
    /// Files are closed, and removed, where nobody waits.
    ~Receiving() { letGo(disk_, std::move(file_)); }

    void begin(std::string came) {
        filled_ = static_cast<std::size_t>(std::min<std::uint64_t>({came.size(), left_, kPiece}));
        piece_.assign(came.begin(), came.begin() + static_cast<std::ptrdiff_t>(filled_));
        piece_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left_, kPiece)));
        beginPiece();
    }

private:
    void beginPiece() {
        // The stream's own clock would close it before its sender can be told.
        stream_.neverExpires();
        patience_.expires_after(context_.limits.pieceWait);
        patience_.async_wait([weak = weak_from_this()](beast::error_code stopped) {
            const std::shared_ptr<Receiving> self = weak.lock();
            if (stopped || !self) return;
            self->tooSlow_ = true;
            self->stream_.cancel();
        });
        fill();
    }
    static HttpAnswer stopped() { return errorAnswer(408, "network", "the file has stopped coming"); }
    void fill() {
        if (filled_ == piece_.size()) return write();
        stream_.async_read_some(boost::asio::buffer(piece_.data() + filled_, piece_.size() - filled_),
                                [self = shared_from_this()](beast::error_code error, std::size_t count) {
                                    self->filled_ += count;
                                    if (!error) return self->fill();
                                    self->patience_.cancel();
                                    if (self->tooSlow_) self->end(tl::unexpected(stopped()));
                                });
    }
    void write() {
        patience_.cancel();
        if (tooSlow_) return end(tl::unexpected(stopped()));
        left_ -= filled_;
        const auto work = [self = shared_from_this()] {
            return self->file_->write(ByteSpan(reinterpret_cast<const std::byte*>(self->piece_.data()), self->filled_));
        };
        context_.disk->run(work, [self = shared_from_this()](const Expected<void>& written) {
            if (!written) return self->end(tl::unexpected(wrong(written.error())));
            if (self->left_ == 0) return self->finish();
            self->filled_ = 0;
            self->piece_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(self->left_, kPiece)));
            self->beginPiece();
        });
    }
    void finish() {
        context_.disk->run([self = shared_from_this()] { return self->file_->finish(); },
                           [self = shared_from_this()](const Expected<std::string>& path) {
                               self->end(path ? Outcome(*path) : tl::unexpected(wrong(path.error())));
                           });
    }
    static HttpAnswer wrong(const Error& error) { return apiErrorAnswer({error.code, error.message}); }
    void end(const Outcome& outcome) { std::exchange(then_, nullptr)(outcome); }

    std::shared_ptr<Guest> guest_;
    DoorStream& stream_;
    DoorContext& context_;
    const std::weak_ptr<Beside> disk_;
    std::shared_ptr<UploadFolder::Incoming> file_;
    boost::asio::steady_timer patience_;
    bool tooSlow_ = false;
    std::vector<char> piece_;
    std::size_t filled_ = 0;
    std::uint64_t left_;
    Then then_;
};

class Sending : public std::enable_shared_from_this<Sending> {
public:
    Sending(std::shared_ptr<Guest> guest, DoorStream& stream, DoorContext& context,
            std::shared_ptr<const AnswerFile> file, std::function<void(bool)> then)
        : guest_(std::move(guest)),
          stream_(stream),
          context_(context),
          disk_(context.disk),
          file_(std::move(file)),
          then_(std::move(then)) {}
    ~Sending() { letGo(disk_, std::move(file_)); }

    void goOn() {
        if (at_ == file_->bytes) return then_(true);
        piece_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(file_->bytes - at_, kPiece)));
        const auto read = [self = shared_from_this()] {
            const ssize_t count = ::pread(self->file_->handle.get(), self->piece_.data(), self->piece_.size(),
                                          static_cast<off_t>(self->at_));
            return static_cast<std::size_t>(std::max<ssize_t>(count, 0));
        };
        context_.disk->run(read, [self = shared_from_this()](std::size_t count) {
            if (count == 0) return self->then_(false);
            self->at_ += count;
            self->stream_.expiresAfter(self->context_.limits.pieceWait);
            boost::asio::async_write(self->stream_, boost::asio::buffer(self->piece_.data(), count),
                                     [self](beast::error_code error, std::size_t) {
                                         if (error) return self->then_(false);
                                         self->goOn();
                                     });
        });
    }

private:
    std::shared_ptr<Guest> guest_;
    DoorStream& stream_;
    DoorContext& context_;
    const std::weak_ptr<Beside> disk_;
    std::shared_ptr<const AnswerFile> file_;
    std::vector<char> piece_;
    std::uint64_t at_ = 0;
    std::function<void(bool)> then_;
};

}  // namespace

void receiveFile(std::shared_ptr<Guest> guest, DoorStream& stream, DoorContext& context,
                 std::shared_ptr<UploadFolder::Incoming> file, std::string came, std::uint64_t length,
                 std::function<void(const tl::expected<std::string, HttpAnswer>& path)> then) {
    std::make_shared<Receiving>(std::move(guest), stream, context, std::move(file), length, std::move(then))
        ->begin(std::move(came));
}

void sendFile(std::shared_ptr<Guest> guest, DoorStream& stream, DoorContext& context,
              std::shared_ptr<const AnswerFile> file, std::function<void(bool sent)> then) {
    std::make_shared<Sending>(std::move(guest), stream, context, std::move(file), std::move(then))->goOn();
}

}  // namespace tessera
