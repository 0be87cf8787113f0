#include "server/sim/SessionActions.h"

#include <deque>

#include <fmt/format.h>

#include "common/base/FailedLogins.h"

namespace tessera {

void SessionActions::carryOut(ServerActions actions) {
    std::deque<ServerAction> pending;
    const auto add = [&](ServerActions more) {
        for (ServerAction& action : around_.peers.perform(std::move(more))) pending.push_back(std::move(action));
    };
    for (add(std::move(actions)); !pending.empty();) {
        const ServerAction action = std::move(pending.front());
        pending.pop_front();
        add(std::visit([&](const auto& what) { return on(what); }, action));
    }
}

ServerActions SessionActions::on(const server_action::SnapshotWanted& wanted) {
    return around_.snapshots.wanted(wanted.connection, around_.time.now());
}

ServerActions SessionActions::on(const server_action::HostEntered& entered) {
    around_.report.entered(entered);
    std::string text = entered.rejoined
                           ? fmt::format("{} is back: enters at frame {}, {:.0f} ms after it was lost", entered.host,
                                         entered.frame.value, toMilliseconds(entered.awayFor))
                           : fmt::format("{} enters at frame {}", entered.host, entered.frame.value);
    if (entered.framesToProve > 0)
        text += fmt::format("; it has held up the others, who wait for it again once it has drawn and shown {}",
                            entered.framesToProve == 1 ? "one frame" : fmt::format("{} frames", entered.framesToProve));
    // A host that was lost, or is on trial, is news.
    entered.rejoined || entered.framesToProve > 0 ? around_.log.info(text) : around_.log.detail(text);
    return {};
}

ServerActions SessionActions::on(const server_action::Fault& fault) {
    around_.report.fault(fault);
    // What it has said of its replica is nothing any more; of one that differs a walk begins after this.
    walks_.erase(fault.host);
    around_.log.warning(fmt::format("frame {}: {}: {}, noticed {:.0f} ms after its last byte{}", fault.frame.value,
                                    fault.host, nameOf(fault.kind), toMilliseconds(fault.detectedAfter),
                                    fault.detail.empty() ? "" : " (" + fault.detail + ")"),
                        {.frame = fault.frame.value, .host = fault.host});
    return {};
}

ServerActions SessionActions::on(const server_action::FrameReleased& released) {
    const TimePoint now = around_.time.now();
    around_.pacing.released(now, released.shown.empty());
    around_.report.released(released);
    around_.budget.released();
    around_.exposure.released();
    if (around_.onReleased) around_.onReleased(around_.pacing.framesReleased());
    return around_.desk.frameReleased(released, now);
}

ServerActions SessionActions::on(const server_action::FrameStats& stats) {
    if (const Expected<HostStats> decoded = decodeStats(stats.stats)) {
        around_.report.stats(stats, *decoded);
        around_.desk.frameDrawn(stats, *decoded, around_.time.now());
        around_.budget.drawn(*decoded);
        around_.exposure.drawn(stats.host, *decoded);
        for (const HeldUp& held : decoded->heldUp)
            around_.programs.heldUp(held.program, stats.host, held.ms, stats.frame);
    }
    return {};
}

ServerActions SessionActions::on(const server_action::FrameShown& shown) {
    around_.report.shown(shown);
    around_.desk.frameShown(shown);
    return {};
}

ServerActions SessionActions::on(const server_action::StateMismatch& mismatch) {
    walks_[mismatch.host] = {++lastWalk_, std::make_shared<StateComparison>()};
    return {};
}

/// The scene goes on: what the replica says is compared with the scene at the list at which it stands, beside the
/// frames.
ServerActions SessionActions::on(const server_action::HashesReceived& hashes) {
    const auto walk = walks_.find(hashes.host);
    if (walk == walks_.end()) return around_.peers.session().repair(hashes.host, around_.time.now());
    StateCompared compared{.host = hashes.host, .walk = walk->second.number, .step = {}};
    const auto at = hashes.objects ? std::nullopt : std::optional(hashes.sequence);
    around_.snapshots.look(at, [hashes, compared, comparison = walk->second.comparison,
                                deliver = around_.deliver](const Aspect* scene) mutable {
        if (!scene)
            compared.step.finding = fmt::format(
                "which object differs is not known: the scene has gone on since list {}", hashes.sequence.value);
        else
            compared.step = hashes.objects ? comparison->objects(*scene, hashes.entries)
                                           : comparison->leaves(*scene, hashes.entries);
        deliver(std::move(compared));
    });
    return {};
}

void SessionActions::compared(const StateCompared& found) {
    const auto walk = walks_.find(found.host);
    if (walk == walks_.end() || walk->second.number != found.walk) return;
    if (found.step.queryLeaf) return carryOut(around_.peers.session().queryObjects(found.host, *found.step.queryLeaf));
    walks_.erase(walk);
    around_.log.warning(
        fmt::format("{}: {}{}", found.host, found.step.named ? "first differing object: " : "", found.step.finding));
    around_.report.mismatch(found.host, found.step.finding);
    carryOut(around_.peers.session().repair(found.host, around_.time.now()));
}

ServerActions SessionActions::on(const server_action::RequestReceived& request) {
    ServerActions answers = around_.desk.received(request, around_.time.now());
    return around_.onAnswered ? around_.onAnswered(std::move(answers)) : answers;
}

ServerActions SessionActions::on(const server_action::ApplicationJoined& joined) {
    around_.desk.applicationJoined(joined.connection,
                                   {.name = joined.name, .who = joined.who, .since = around_.time.now()},
                                   around_.peers.addressOf(joined.connection), joined.panel.get());
    return {};
}

ServerActions SessionActions::on(const server_action::ApplicationLeft& left) {
    around_.desk.applicationLeft(left.connection);
    return {};
}

ServerActions SessionActions::on(const server_action::BlobsEverywhere& everywhere) {
    return around_.desk.blobsEverywhere(everywhere.token);
}

ServerActions SessionActions::on(const server_action::ImageReceived& image) {
    return around_.desk.imageReceived(image, around_.time.now());
}

ServerActions SessionActions::on(const server_action::EpochRaised& raised) {
    around_.log.warning(
        fmt::format("{} has seen a later epoch of this wall than {}, which this machine's clock gave: it is "
                    "{} now",
                    raised.host, raised.from.value, raised.to.value));
    if (around_.onEpochRaised) around_.onEpochRaised(raised.to);
    return {};
}

ServerActions SessionActions::on(const server_action::InputReceived& input) {
    around_.steering.received(input.host, input.states, around_.time.now());
    return {};
}

ServerActions SessionActions::on(const server_action::InputEnded& ended) {
    around_.steering.hostLeft(ended.host);
    return {};
}

ServerActions SessionActions::on(const server_action::UploadReceived& received) {
    around_.desk.uploading(received);
    return {};
}

ServerActions SessionActions::on(const server_action::LoginsSlowed& slowed) {
    around_.log.warning(describeSlowed(slowed.source));
    return {};
}

ServerActions SessionActions::on(const server_action::PixelsDiffer& differ) {
    around_.log.warning(
        fmt::format("{} draws other pixels than {} (another CPU or driver): seams between them may show", differ.host,
                    differ.reference));
    return {};
}

}  // namespace tessera
