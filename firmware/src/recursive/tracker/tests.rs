mod answers;
mod bench;
mod rejections;
mod starts;
mod steps;
mod way;
