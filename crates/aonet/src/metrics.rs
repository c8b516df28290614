//! SSIM and PSNR.
