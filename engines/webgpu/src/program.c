#include "program.h"

#include "json.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* More than 8 arrays and 4 uniforms are in no shader. */
enum { MOST_BINDINGS = 12, FRAME_BYTES = 112 };

typedef struct Pass {
    WGPUComputePipeline pipeline;
    WGPUBindGroup group;
    int sees_frame;
    uint32_t workgroups[3];
} Pass;

struct AonetProgram {
    WGPUDevice device;
    WGPUQueue queue;
    uint32_t size[2];
    int layers;
    size_t buffer_count, pass_count;
    WGPUBuffer *buffers, frame;
    int *cleared; /* for every buffer */
    Pass *passes;
    WGPUBindGroupLayout frame_layout;
    WGPURenderPipeline image;
    WGPUBindGroup image_group;
};

static WGPUStringView view(const char *text) { return (WGPUStringView){text, strlen(text)}; }

/* A file with a 0 behind it. */
static char *read_file(const char *folder, const char *name, size_t *bytes) {
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%s", folder, name) >= (int)sizeof path) return NULL;
    FILE *file = fopen(path, "rb");
    if (!file) return NULL;
    long end = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
    char *found = end >= 0 && fseek(file, 0, SEEK_SET) == 0 ? calloc(1, (size_t)end + 1) : NULL;
    if (found && fread(found, 1, (size_t)end, file) != (size_t)end) {
        free(found);
        found = NULL;
    }
    fclose(file);
    *bytes = found ? (size_t)end : 0;
    return found;
}

static WGPUBuffer empty(WGPUDevice device, uint64_t bytes, WGPUBufferUsage usage) {
    WGPUBufferDescriptor descriptor = {.size = bytes, .usage = usage | WGPUBufferUsage_CopyDst};
    return wgpuDeviceCreateBuffer(device, &descriptor);
}

/* The buffers of the list; 0 where they and the block do not fit. */
static int make_buffers(AonetProgram *self, const char *list, const char *block, size_t block_bytes) {
    self->buffer_count = json_count(list);
    self->buffers = calloc(self->buffer_count + 1, sizeof *self->buffers);
    self->cleared = calloc(self->buffer_count + 1, sizeof *self->cleared);
    if (!self->buffers || !self->cleared) return 0;
    for (size_t i = 0; i < self->buffer_count; i++) {
        const char *entry = json_item(list, i), *part = json_field(entry, "contents");
        uint64_t bytes = json_number(json_field(entry, "bytes"));
        uint64_t offset = json_number(json_field(part, "offset")), length = json_number(json_field(part, "bytes"));
        if (bytes == 0 || bytes % 4 || length > bytes || offset > block_bytes || length > block_bytes - offset) return 0;
        int uniform = json_is(json_field(entry, "usage"), "uniform");
        self->buffers[i] = empty(self->device, bytes, uniform ? WGPUBufferUsage_Uniform : WGPUBufferUsage_Storage);
        self->cleared[i] = json_true(json_field(entry, "cleared"));
        if (part) wgpuQueueWriteBuffer(self->queue, self->buffers[i], 0, block + offset, length);
    }
    return 1;
}

static WGPUBindGroupLayout layout(WGPUDevice device, const WGPUBindGroupLayoutEntry *entries, size_t count) {
    WGPUBindGroupLayoutDescriptor descriptor = {.entryCount = count, .entries = entries};
    return wgpuDeviceCreateBindGroupLayout(device, &descriptor);
}

static WGPUBindGroup group(WGPUDevice device, WGPUBindGroupLayout of, const WGPUBindGroupEntry *entries, size_t count) {
    WGPUBindGroupDescriptor descriptor = {.layout = of, .entryCount = count, .entries = entries};
    return wgpuDeviceCreateBindGroup(device, &descriptor);
}

/* Group and layout of a pass's own buffers; 0 where the list is wrong. */
static int own(const AonetProgram *self, const char *bindings, WGPUShaderStage stage, WGPUBindGroupLayout *of, WGPUBindGroup *to) {
    WGPUBindGroupLayoutEntry types[MOST_BINDINGS] = {0};
    WGPUBindGroupEntry entries[MOST_BINDINGS] = {0};
    size_t count = json_count(bindings);
    if (count > MOST_BINDINGS) return 0;
    for (size_t i = 0; i < count; i++) {
        const char *kind = NULL;
        uint64_t buffer = json_number(json_only(json_item(bindings, i), &kind));
        if (!kind || buffer >= self->buffer_count) return 0;
        types[i].binding = entries[i].binding = (uint32_t)i;
        types[i].visibility = stage;
        types[i].buffer.type = json_is(kind, "uniform") ? WGPUBufferBindingType_Uniform
                               : json_is(kind, "read")  ? WGPUBufferBindingType_ReadOnlyStorage
                                                        : WGPUBufferBindingType_Storage;
        entries[i].buffer = self->buffers[buffer];
        entries[i].size = WGPU_WHOLE_SIZE;
    }
    *of = layout(self->device, types, count);
    *to = group(self->device, *of, entries, count);
    return 1;
}

static WGPUPipelineLayout pipeline_layout(const AonetProgram *self, int sees_frame, WGPUBindGroupLayout of) {
    WGPUBindGroupLayout both[2] = {self->frame_layout, of};
    WGPUPipelineLayoutDescriptor descriptor = {.bindGroupLayoutCount = sees_frame ? 2 : 1, .bindGroupLayouts = both + !sees_frame};
    return wgpuDeviceCreatePipelineLayout(self->device, &descriptor);
}

static int make_pass(AonetProgram *self, Pass *pass, const char *entry, WGPUShaderModule *modules, size_t module_count) {
    uint64_t shader = json_number(json_field(entry, "shader"));
    WGPUBindGroupLayout of;
    if (shader >= module_count || !own(self, json_field(entry, "bindings"), WGPUShaderStage_Compute, &of, &pass->group)) return 0;
    pass->sees_frame = json_true(json_field(entry, "sees_frame"));
    for (size_t axis = 0; axis < 3; axis++) {
        pass->workgroups[axis] = (uint32_t)json_number(json_item(json_field(entry, "workgroups"), axis));
    }
    WGPUComputePipelineDescriptor descriptor = {.layout = pipeline_layout(self, pass->sees_frame, of)};
    descriptor.compute.module = modules[shader];
    descriptor.compute.entryPoint = view("main");
    pass->pipeline = wgpuDeviceCreateComputePipeline(self->device, &descriptor);
    wgpuPipelineLayoutRelease(descriptor.layout);
    wgpuBindGroupLayoutRelease(of);
    return 1;
}

static int make_image(AonetProgram *self, const char *entry, WGPUShaderModule *modules, size_t count, WGPUTextureFormat output) {
    uint64_t shader = json_number(json_field(entry, "shader"));
    WGPUBindGroupLayout of;
    if (shader >= count || !own(self, json_field(entry, "bindings"), WGPUShaderStage_Fragment, &of, &self->image_group)) return 0;
    WGPUColorTargetState target = {.format = output, .writeMask = WGPUColorWriteMask_All};
    WGPUFragmentState fragment = {.module = modules[shader], .entryPoint = view("main"), .targetCount = 1, .targets = &target};
    WGPURenderPipelineDescriptor descriptor = {.layout = pipeline_layout(self, 1, of), .fragment = &fragment};
    descriptor.vertex.module = modules[shader];
    descriptor.vertex.entryPoint = view("cover");
    descriptor.primitive.topology = WGPUPrimitiveTopology_TriangleList;
    descriptor.multisample.count = 1;
    descriptor.multisample.mask = UINT32_MAX;
    self->image = wgpuDeviceCreateRenderPipeline(self->device, &descriptor);
    wgpuPipelineLayoutRelease(descriptor.layout);
    wgpuBindGroupLayoutRelease(of);
    return 1;
}

static int make_passes(AonetProgram *self, const char *document, WGPUTextureFormat output) {
    const char *shaders = json_field(document, "shaders"), *passes = json_field(document, "passes");
    size_t count = json_count(shaders);
    self->pass_count = json_count(passes);
    self->passes = calloc(self->pass_count + 1, sizeof *self->passes);
    WGPUShaderModule *modules = calloc(count + 1, sizeof *modules);
    int good = self->passes && modules && count;
    for (size_t i = 0; good && i < count; i++) {
        char *text = json_string(json_item(shaders, i));
        good = text != NULL;
        if (!good) break;
        WGPUShaderSourceWGSL source = {.chain.sType = WGPUSType_ShaderSourceWGSL, .code = view(text)};
        WGPUShaderModuleDescriptor descriptor = {.nextInChain = &source.chain};
        modules[i] = wgpuDeviceCreateShaderModule(self->device, &descriptor);
        free(text);
    }
    for (size_t i = 0; good && i < self->pass_count; i++) {
        good = make_pass(self, &self->passes[i], json_item(passes, i), modules, count);
    }
    good = good && make_image(self, json_field(document, "image"), modules, count, output);
    for (size_t i = 0; modules && i < count && modules[i]; i++) wgpuShaderModuleRelease(modules[i]);
    free(modules);
    return good;
}

static void make_frame_layout(AonetProgram *self) {
    WGPUBindGroupLayoutEntry types[4] = {0};
    for (uint32_t i = 0; i < 4; i++) {
        types[i].binding = i;
        types[i].visibility = WGPUShaderStage_Compute | WGPUShaderStage_Fragment;
        if (i == 0) {
            types[i].buffer.type = WGPUBufferBindingType_Uniform;
        } else {
            types[i].texture.sampleType = WGPUTextureSampleType_UnfilterableFloat;
            types[i].texture.viewDimension = WGPUTextureViewDimension_2D;
        }
    }
    self->frame_layout = layout(self->device, types, 2 + (size_t)self->layers);
    self->frame = empty(self->device, FRAME_BYTES, WGPUBufferUsage_Uniform);
}

AonetProgram *aonet_program_new(WGPUDevice device, const char *folder, WGPUTextureFormat output, char error[256]) {
    size_t json_bytes = 0, block_bytes = 0;
    char *json = read_file(folder, "program.json", &json_bytes), *block = read_file(folder, "program.bin", &block_bytes);
    AonetProgram *self = calloc(1, sizeof *self);
    const char *wrong = NULL;
    if (!self || !json || !block) {
        wrong = "expected program.json and program.bin, found none";
    } else if (!json_valid(json, json + json_bytes) || json_number(json_field(json, "format")) != 1) {
        wrong = "expected a program of format 1 (aonet export --program DIR --size WxH), found something else";
    } else if (json_number(json_field(json, "blob_bytes")) != block_bytes) {
        wrong = "expected two files that belong together, found a block of another length";
    } else if (json_number(json_field(json_field(json, "frame"), "bytes")) != FRAME_BYTES) {
        wrong = "expected a frame of 112 bytes, found another";
    } else {
        wgpuDeviceAddRef(self->device = device);
        self->queue = wgpuDeviceGetQueue(device);
        for (size_t i = 0; i < 2; i++) self->size[i] = (uint32_t)json_number(json_item(json_field(json, "size"), i));
        self->layers = json_is(json_field(json_field(json, "textures"), "layers"), "two") ? 2 : 1;
        make_frame_layout(self);
        int good = make_buffers(self, json_field(json, "buffers"), block, block_bytes) && make_passes(self, json, output);
        if (!good) wrong = "expected a list whose parts fit, or memory for it, found neither";
    }
    free(json);
    free(block);
    if (!wrong) return self;
    snprintf(error, 256, "%.100s: %s", folder, wrong);
    aonet_program_free(self);
    return NULL;
}

void aonet_program_size(const AonetProgram *self, uint32_t size[2]) { memcpy(size, self->size, sizeof self->size); }

void aonet_program_encode(AonetProgram *self, WGPUCommandEncoder encoder, const AonetTextures *textures, const AonetFrame *frame) {
    wgpuQueueWriteBuffer(self->queue, self->frame, 0, frame, sizeof *frame);
    for (size_t i = 0; i < self->buffer_count; i++) {
        if (self->cleared[i]) wgpuCommandEncoderClearBuffer(encoder, self->buffers[i], 0, WGPU_WHOLE_SIZE);
    }
    WGPUBindGroupEntry entries[4] = {{.binding = 0, .buffer = self->frame, .size = WGPU_WHOLE_SIZE},
                                     {.binding = 1, .textureView = textures->normals},
                                     {.binding = 2, .textureView = textures->depth},
                                     {.binding = 3, .textureView = textures->second}};
    WGPUBindGroup bound = group(self->device, self->frame_layout, entries, 2 + (size_t)self->layers);
    WGPUComputePassEncoder compute = wgpuCommandEncoderBeginComputePass(encoder, NULL);
    for (const Pass *pass = self->passes; pass < self->passes + self->pass_count; pass++) {
        wgpuComputePassEncoderSetPipeline(compute, pass->pipeline);
        if (pass->sees_frame) wgpuComputePassEncoderSetBindGroup(compute, 0, bound, 0, NULL);
        wgpuComputePassEncoderSetBindGroup(compute, pass->sees_frame ? 1 : 0, pass->group, 0, NULL);
        wgpuComputePassEncoderDispatchWorkgroups(compute, pass->workgroups[0], pass->workgroups[1], pass->workgroups[2]);
    }
    wgpuComputePassEncoderEnd(compute);
    wgpuComputePassEncoderRelease(compute);

    WGPURenderPassColorAttachment target = {.view = textures->visibility, .depthSlice = WGPU_DEPTH_SLICE_UNDEFINED};
    target.loadOp = WGPULoadOp_Clear;
    target.storeOp = WGPUStoreOp_Store;
    WGPURenderPassDescriptor descriptor = {.colorAttachmentCount = 1, .colorAttachments = &target};
    WGPURenderPassEncoder draw = wgpuCommandEncoderBeginRenderPass(encoder, &descriptor);
    wgpuRenderPassEncoderSetPipeline(draw, self->image);
    wgpuRenderPassEncoderSetBindGroup(draw, 0, bound, 0, NULL);
    wgpuRenderPassEncoderSetBindGroup(draw, 1, self->image_group, 0, NULL);
    wgpuRenderPassEncoderDraw(draw, 3, 1, 0, 0);
    wgpuRenderPassEncoderEnd(draw);
    wgpuRenderPassEncoderRelease(draw);
    wgpuBindGroupRelease(bound);
}

void aonet_program_free(AonetProgram *self) {
    if (!self) return;
    for (size_t i = 0; self->buffers && i < self->buffer_count; i++) {
        if (self->buffers[i]) wgpuBufferRelease(self->buffers[i]);
    }
    for (size_t i = 0; self->passes && i < self->pass_count; i++) {
        if (self->passes[i].pipeline) wgpuComputePipelineRelease(self->passes[i].pipeline);
        if (self->passes[i].group) wgpuBindGroupRelease(self->passes[i].group);
    }
    if (self->image) wgpuRenderPipelineRelease(self->image);
    if (self->image_group) wgpuBindGroupRelease(self->image_group);
    if (self->frame) wgpuBufferRelease(self->frame);
    if (self->frame_layout) wgpuBindGroupLayoutRelease(self->frame_layout);
    if (self->queue) wgpuQueueRelease(self->queue);
    if (self->device) wgpuDeviceRelease(self->device);
    free(self->buffers);
    free(self->cleared);
    free(self->passes);
    free(self);
}
