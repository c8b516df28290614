/* Visibility of a small scene by a program of aonet, without a window:
 *
 *     offscreen FOLDER OUT     FOLDER: aonet export NETWORK --program FOLDER --size WxH --depth linear --precision f32
 *
 * writes OUT.depth, OUT.normal and OUT.visibility: 32-bit floats, row by row from the top. */
#include "program.h"
#include "scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const float RADIUS = 0.5f;

static void fail(const char *what, WGPUStringView message) {
    fprintf(stderr, "offscreen: %s: %.*s\n", what, message.length == WGPU_STRLEN ? 1000 : (int)message.length, message.data ? message.data : "");
    exit(1);
}

static void on_error(WGPUDevice const *device, WGPUErrorType type, WGPUStringView message, void *a, void *b) {
    (void)device, (void)type, (void)a, (void)b;
    fail("device", message);
}

static void on_adapter(WGPURequestAdapterStatus status, WGPUAdapter adapter, WGPUStringView message, void *to, void *b) {
    (void)b;
    if (status != WGPURequestAdapterStatus_Success) fail("adapter", message);
    *(WGPUAdapter *)to = adapter;
}

static void on_device(WGPURequestDeviceStatus status, WGPUDevice device, WGPUStringView message, void *to, void *b) {
    (void)b;
    if (status != WGPURequestDeviceStatus_Success) fail("device", message);
    *(WGPUDevice *)to = device;
}

static void on_mapped(WGPUMapAsyncStatus status, WGPUStringView message, void *to, void *b) {
    (void)b;
    if (status != WGPUMapAsyncStatus_Success) fail("map", message);
    *(int *)to = 1;
}

static WGPUDevice open_device(WGPUInstance instance) {
    WGPUAdapter adapter = NULL;
    WGPURequestAdapterCallbackInfo to_adapter = {.mode = WGPUCallbackMode_AllowProcessEvents, .callback = on_adapter, .userdata1 = &adapter};
    wgpuInstanceRequestAdapter(instance, NULL, to_adapter);
    while (!adapter) wgpuInstanceProcessEvents(instance);
    WGPUDevice device = NULL;
    WGPUDeviceDescriptor descriptor = {.uncapturedErrorCallbackInfo.callback = on_error};
    WGPURequestDeviceCallbackInfo to_device = {.mode = WGPUCallbackMode_AllowProcessEvents, .callback = on_device, .userdata1 = &device};
    wgpuAdapterRequestDevice(adapter, &descriptor, to_device);
    while (!device) wgpuInstanceProcessEvents(instance);
    wgpuAdapterRelease(adapter);
    return device;
}

static WGPUTexture texture(WGPUDevice device, const uint32_t size[2], WGPUTextureFormat format, WGPUTextureUsage usage) {
    WGPUTextureDescriptor descriptor = {.usage = usage, .dimension = WGPUTextureDimension_2D, .size = {size[0], size[1], 1}};
    descriptor.format = format;
    descriptor.mipLevelCount = descriptor.sampleCount = 1;
    return wgpuDeviceCreateTexture(device, &descriptor);
}

/* A texture of so many floats a pixel. */
static WGPUTexture filled(WGPUDevice device, const uint32_t size[2], const float *values, uint32_t channels) {
    WGPUTextureFormat format = channels == 1 ? WGPUTextureFormat_R32Float : WGPUTextureFormat_RGBA32Float;
    WGPUTexture made = texture(device, size, format, WGPUTextureUsage_TextureBinding | WGPUTextureUsage_CopyDst);
    WGPUQueue queue = wgpuDeviceGetQueue(device);
    WGPUTexelCopyTextureInfo to = {.texture = made, .aspect = WGPUTextureAspect_All};
    WGPUTexelCopyBufferLayout rows = {.bytesPerRow = 4 * channels * size[0], .rowsPerImage = size[1]};
    WGPUExtent3D extent = {size[0], size[1], 1};
    wgpuQueueWriteTexture(queue, &to, values, (size_t)4 * channels * size[0] * size[1], &rows, &extent);
    wgpuQueueRelease(queue);
    return made;
}

static void write_file(const char *prefix, const char *name, const void *bytes, size_t count) {
    char path[4096];
    snprintf(path, sizeof path, "%s.%s", prefix, name);
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(bytes, 1, count, file) != count || fclose(file)) {
        perror(path);
        exit(1);
    }
}

/* Submits what was encoded and writes a texture of one float a pixel into a file. */
static void write_texture(WGPUInstance instance, WGPUDevice device, WGPUCommandEncoder encoder, WGPUTexture from, const uint32_t size[2], const char *prefix) {
    uint32_t row = (4 * size[0] + 255) / 256 * 256;
    WGPUBufferDescriptor descriptor = {.usage = WGPUBufferUsage_CopyDst | WGPUBufferUsage_MapRead, .size = (uint64_t)row * size[1]};
    WGPUBuffer buffer = wgpuDeviceCreateBuffer(device, &descriptor);
    WGPUTexelCopyTextureInfo source = {.texture = from, .aspect = WGPUTextureAspect_All};
    WGPUTexelCopyBufferInfo to = {.layout = {.bytesPerRow = row, .rowsPerImage = size[1]}, .buffer = buffer};
    WGPUExtent3D extent = {size[0], size[1], 1};
    wgpuCommandEncoderCopyTextureToBuffer(encoder, &source, &to, &extent);
    WGPUCommandBuffer commands = wgpuCommandEncoderFinish(encoder, NULL);
    WGPUQueue queue = wgpuDeviceGetQueue(device);
    wgpuQueueSubmit(queue, 1, &commands);
    int mapped = 0;
    WGPUBufferMapCallbackInfo callback = {.mode = WGPUCallbackMode_AllowProcessEvents, .callback = on_mapped, .userdata1 = &mapped};
    wgpuBufferMapAsync(buffer, WGPUMapMode_Read, 0, descriptor.size, callback);
    while (!mapped) wgpuInstanceProcessEvents(instance);
    const char *rows = wgpuBufferGetConstMappedRange(buffer, 0, descriptor.size);
    char *tight = need(malloc((size_t)4 * size[0] * size[1]));
    for (size_t y = 0; y < size[1]; y++) memcpy(tight + 4 * size[0] * y, rows + row * y, (size_t)4 * size[0]);
    write_file(prefix, "visibility", tight, (size_t)4 * size[0] * size[1]);
    free(tight);
    wgpuCommandBufferRelease(commands);
    wgpuQueueRelease(queue);
    wgpuBufferRelease(buffer);
}

int main(int count, char **arguments) {
    if (count != 3) {
        fprintf(stderr, "usage: offscreen FOLDER OUT\n");
        return 2;
    }
    WGPUInstance instance = wgpuCreateInstance(NULL);
    WGPUDevice device = open_device(instance);
    char error[256];
    AonetProgram *program = aonet_program_new(device, arguments[1], WGPUTextureFormat_R32Float, error);
    if (!program) {
        fprintf(stderr, "offscreen: %s\n", error);
        return 1;
    }
    uint32_t size[2];
    aonet_program_size(program, size);
    GBuffer scene = scene_render(size[0], size[1], 0, 0);
    size_t pixels = gbuffer_pixels(&scene);
    float *normals = need(calloc(pixels, 4 * sizeof(float)));
    for (size_t i = 0; i < pixels; i++) memcpy(normals + 4 * i, scene.normal + 3 * i, 3 * sizeof(float));
    WGPUTexture textures[3] = {filled(device, size, normals, 4), filled(device, size, scene.depth, 1),
                               texture(device, size, WGPUTextureFormat_R32Float, WGPUTextureUsage_RenderAttachment | WGPUTextureUsage_CopySrc)};
    WGPUTextureView views[3];
    for (size_t i = 0; i < 3; i++) views[i] = wgpuTextureCreateView(textures[i], NULL);

    float focal = 0.5f * (float)size[1] / tanf(0.5f * scene.fov_y);
    AonetFrame frame = {
        .view_from_normals = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}},
        .size = {size[0], size[1]},
        .depth_line = {1, 0},
        .pixel_size = {1 / focal, 0},
        .centre = {0.5f * (float)size[0], 0.5f * (float)size[1]},
        .aspect = 1,
        .radius = RADIUS,
        .log2_radius_px = log2f(RADIUS * focal),
    };
    WGPUCommandEncoder encoder = wgpuDeviceCreateCommandEncoder(device, NULL);
    aonet_program_encode(program, encoder, &(AonetTextures){views[0], views[1], NULL, views[2]}, &frame);
    write_texture(instance, device, encoder, textures[2], size, arguments[2]);
    write_file(arguments[2], "depth", scene.depth, pixels * sizeof(float));
    write_file(arguments[2], "normal", scene.normal, 3 * pixels * sizeof(float));
    printf("%u %u %.9g %.9g\n", size[0], size[1], (double)scene.fov_y * 57.29577951308232, (double)RADIUS);

    wgpuCommandEncoderRelease(encoder);
    for (size_t i = 0; i < 3; i++) {
        wgpuTextureViewRelease(views[i]);
        wgpuTextureRelease(textures[i]);
    }
    free(normals);
    gbuffer_free(&scene);
    aonet_program_free(program);
    wgpuDeviceRelease(device);
    wgpuInstanceRelease(instance);
    return 0;
}
