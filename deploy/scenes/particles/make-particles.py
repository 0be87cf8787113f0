#!/usr/bin/env python3
"""Writes particles.tsct and its picture of a puff: python3 deploy/scenes/particles/make-particles.py"""
import colorsys
import math
import os
import random
import struct
import zlib

here = os.path.dirname(os.path.abspath(__file__))
random.seed(4)
n=64
rows=[]
# A soft puff: a few blurred blobs.
blobs=[(random.uniform(-.35,.35),random.uniform(-.35,.35),random.uniform(.25,.5)) for _ in range(9)]
for y in range(n):
    rows.append(bytearray([0]))
    for x in range(n):
        u,v=(x+.5)/n*2-1,(y+.5)/n*2-1
        d=sum(math.exp(-((u-a)**2+(v-b)**2)/(r*r)*2.2) for a,b,r in blobs)
        rim=max(0,1-(u*u+v*v))
        a=min(1,.55*d)*rim**1.2
        s=int(225+30*min(1,d/4))
        rows[-1]+=bytes([min(255,s)]*3+[int(255*a)])
def chunk(kind,data):
    return struct.pack('>I',len(data))+kind+data+struct.pack('>I',zlib.crc32(kind+data))
with open(os.path.join(here,'puff.png'),'wb') as f:
    f.write(b'\x89PNG\r\n\x1a\n'+chunk(b'IHDR',
                                       struct.pack('>IIBBBBB',n,n,8,6,0,0,0))+chunk(
                                           b'IDAT',zlib.compress(b''.join(rows),9))+chunk(b'IEND',b''))
def num(v): 
    s='%.4g'%v
    return '0' if s=='-0' else s
def row(name,vals,per=18):
    vals=[v if isinstance(v,str) else num(v) for v in vals]
    lines=[','.join(vals[i:i+per]) for i in range(0,len(vals),per)]
    return '    %s: [%s]'%(name,',\n      '.join(lines))
out=[]
out.append('''# Particles: smoke of quads that face the head of who looks, with a picture, ages and ramps; sparks as \
lines; a ring of points. Units are metres.

image { name: "puff" uri: "particles/puff.png" wrap_u: CLAMP wrap_v: CLAMP }
material { name: "smoke"  base_color { r: 1 g: 1 b: 1 a: 0.55 } base_color_image: "puff" }
material { name: "light"  base_color { r: 1 g: 1 b: 1 } }
material { name: "ground" base_color { r: 0.32 g: 0.3 b: 0.27 } roughness: 0.9 }
material { name: "brick"  base_color { r: 0.55 g: 0.2 b: 0.13 } roughness: 0.8 }
material { name: "iron"   base_color { r: 0.35 g: 0.36 b: 0.4 } metallic: 1 roughness: 0.45 }

node { name: "camera" camera {} }
node { name: "sun" transform { rotation { axis { x: 1 y: 0.5 } angle_deg: -40 } } directional_light { intensity: 2.4 } }
node { name: "sky" environment { sky { r: 0.35 g: 0.4 b: 0.5 } ground { r: 0.2 g: 0.18 b: 0.16 } background { r: 0.02 \
g: 0.03 b: 0.05 } } }
node { name: "floor" transform { translation { y: 0.72 z: -0.6 } } material: "ground" box { size { x: 3.6 y: 0.04 z: 2 \
} } }
node { name: "chimney" transform { translation { x: -0.95 y: 0.98 z: -0.5 } } material: "brick" tube { outer_radius: \
0.14 inner_radius: 0.09 height: 0.5 } }
node { name: "anvil" transform { translation { x: 0.1 y: 0.8 z: -0.2 } } material: "iron" box { size { x: 0.36 y: 0.14 \
z: 0.2 } } }
''')
# smoke
P,A,T,S=[],[],[],[]
for i in range(130):
    a=(i+random.random())/130
    t=a*2.2
    x=-.95+.28*a*a+random.gauss(0,.02+.1*a); y=1.22+.42*t-.05*t*t+random.gauss(0,.02); z=-.5+random.gauss(0,.02+.1*a)
    P+=[x,y,z];A.append(a);T.append(random.uniform(0,6.28));S.append(random.uniform(.8,1.2))
out.append('node { name: "smoke" material: "smoke"\n  particles { mode: QUADS\n'
           +'\n'.join([row('positions',P),row('sizes',S,30),row('ages',A,30),
                       row('turns',T,30)])+'\n    age_colors: [0x40302CFF, 0x8A8683C0, 0xC8C8CC60, 0xE0E4EA00]\n    '
                                           'age_sizes: [0.16, 0.3, 0.44, 0.6] } }\n')
# sparks
P,Q,A=[],[],[]
for i in range(160):
    th=random.uniform(0,2*math.pi); v=random.uniform(.6,1.9); up=random.uniform(.5,2.2)
    t=random.random()*.42
    def at(t): return (.1+.5*v*math.cos(th)*t,.88+up*t-.5*5*t*t,-.2+.5*v*math.sin(th)*t)
    h=at(t); q=at(max(0,t-.035))
    if h[1]<.75: continue
    P+=h;Q+=q;A.append(t/.43)
out.append('node { name: "sparks" material: "light"\n  particles { mode: LINES size: 1\n'
           +'\n'.join([row('positions',P),row('tails',Q),
                       row('ages',A,30)])+'\n    age_colors: [0xFFF8E0FF, 0xFFC040FF, 0xE04010C0, 0x60100000]\n    '
                                          'age_sizes: [3.5, 2.5, 1.5] } }\n')
# ring of points
P,S,C=[],[],[]
for i in range(420):
    th=random.uniform(0,2*math.pi); r=.36+random.gauss(0,.05); 
    P+=[r*math.cos(th),random.gauss(0,.018),r*math.sin(th)]
    S.append(random.choice([.008,.012,.016,.03]))
    h=(th/(2*math.pi)+random.gauss(0,.03))%1
    cr,cg,cb=colorsys.hsv_to_rgb(h,.45,1)
    C.append('0x%02X%02X%02X%02X'%(int(cr*255),int(cg*255),int(cb*255),random.choice([255,255,170])))
out.append('node { name: "ring" transform { translation { x: 1.05 y: 1.55 z: -0.4 } rotation { axis { x: 1 z: 0.4 } '
           'angle_deg: 32 } } material: "light"\n  node { name: "core" material: "iron" sphere { radius: 0.16 '
           'segments: 32 } }\n  node { name: "points"\n  particles {\n'
           +'\n'.join([row('positions',P),row('sizes',S,30),row('colors',C,14)])+' } } }\n')
with open(os.path.join(here,'..','particles.tsct'),'w') as f:
    f.write('\n'.join(out))
