// Contract: the header is C++17, its types fit C++'s ways of ownership and threads, and many
// instances over one model in many threads get the same bytes.
//
//     check MODEL

#include "unic.h"

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

void must(UnicStatus status) {
    if (status != UNIC_STATUS_OK)
        throw std::runtime_error(std::string(unic_status_name(status)) + ": " + unic_last_error());
}

struct Release {
    void operator()(UnicModel *model) const { unic_model_release(model); }
    void operator()(UnicInstance *instance) const { unic_instance_release(instance); }
};
using Model = std::unique_ptr<UnicModel, Release>;
using Instance = std::unique_ptr<UnicInstance, Release>;

Model open(const char *path) {
    UnicModel *model = nullptr;
    must(unic_model_from_path(path, &model));
    return Model(model);
}

Instance wear(const Model &model, const UnicOptions &options) {
    UnicInstance *instance = nullptr;
    must(unic_instance_create(model.get(), &options, &instance));
    return Instance(instance);
}

// Threads of an engine, started for every job.
void parallel_for(void *, std::uint32_t jobs, UnicJob job, void *data) {
    std::vector<std::thread> threads;
    for (std::uint32_t i = 0; i < jobs; i++)
        threads.emplace_back(job, data);
    for (std::thread &thread : threads)
        thread.join();
}

using Positions = std::vector<std::array<float, 3>>;

// Positions after some frames of a character that turns, in Unity's axes.
Positions dance(const Model &model, UnicThreads threads) {
    UnicModelInfo info{};
    info.size = sizeof info;
    must(unic_model_info(model.get(), &info));
    UnicOptions options;
    must(unic_options_init(&options, sizeof options));
    options.axes = UNIC_AXES_UNITY;
    options.threads = threads;
    options.thread_count = 2;
    options.parallel_for = parallel_for;
    const Instance instance = wear(model, options);

    Positions positions(info.vertex_count);
    UnicVertices to{};
    to.positions = positions.front().data();
    to.count = positions.size();
    // The rest pose, turned as a whole: rotations from rest.
    std::vector<std::array<float, 4>> rotations(info.joint_count);
    for (int frame = 0; frame < 4; frame++) {
        const float half = 0.05f * static_cast<float>(frame);
        for (auto &rotation : rotations)
            rotation = {0.0f, std::sin(half), 0.0f, std::cos(half)};
        UnicPose pose{};
        pose.root[1] = 0.9f;
        pose.rotation_kind = UNIC_ROTATIONS_FROM_REST;
        pose.joint_count = info.joint_count;
        pose.rotations = rotations.front().data();
        UnicStepInput input{};
        input.size = sizeof input;
        input.pose = &pose;
        must(frame == 0 ? unic_instance_reset(instance.get(), &input, &to)
                        : unic_instance_step(instance.get(), &input, &to));
    }
    return positions;
}

} // namespace

int main(int count, char **arguments) try {
    if (count != 2)
        throw std::runtime_error("expected an argument");
    const Model model = open(arguments[1]);
    const Positions expected = dance(model, UNIC_THREADS_NONE);
    std::vector<Positions> found(6);
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < found.size(); i++) {
        threads.emplace_back([&model, &found, i] {
            constexpr UnicThreads kinds[] = {UNIC_THREADS_NONE, UNIC_THREADS_POOL, UNIC_THREADS_CALLER};
            found[i] = dance(model, kinds[i % 3]);
        });
    }
    for (std::thread &thread : threads)
        thread.join();
    for (const Positions &positions : found)
        if (std::memcmp(positions.data(), expected.data(), sizeof expected[0] * expected.size()) != 0)
            throw std::runtime_error("expected the same bytes in all threads");
    try {
        open("no such file");
    } catch (const std::runtime_error &) {
        std::cout << "ok\n";
        return 0;
    }
    throw std::runtime_error("expected an error for a missing file");
} catch (const std::exception &error) {
    std::cerr << error.what() << '\n';
    return 1;
}
