(** Accepted bounds on how far a float32 evaluation is from the exact function hold. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Float Meaning Steepness Sets Distance Blocks
    Lower Values Enclosures Intervals Centred Claims Slopes Witness Laws Ranges.
Import ListNotations.
Open Scope R_scope.
#[local] Arguments Z.add : simpl never.
#[local] Arguments Z.of_nat : simpl never.

Lemma close_length r x y : close r x y -> length x = length r /\ length y = length r.
Proof.
  revert x y. induction r as [|e r IH]; intros [|a x] [|b y]; simpl;
    try tauto. intros [_ H]. destruct (IH _ _ H). auto.
Qed.
Lemma close_relu r x y : close r x y -> close r (map relu x) (map relu y).
Proof.
  revert x y. induction r as [|e r IH]; intros [|a x] [|b y]; simpl; try tauto. intros [H G]. split; auto.
  eapply Rle_trans; [|exact H]. unfold relu, Rmax. repeat destruct (Rle_dec _ _); unfold Rabs;
    repeat destruct (Rcase_abs _); lra.
Qed.
Lemma close_square r x y : close r x y -> square (minus y x) <= square (reals r).
Proof.
  unfold square. revert x y. induction r as [|e r IH]; intros [|a x] [|b y]; simpl; try tauto; try lra.
  intros [H G]. specialize (IH _ _ G). unfold minus in IH |- *. simpl.
  replace (b + -1 * a) with (b - a) by ring. assert ((b - a) * (b - a) <= real e * real e); [|lra].
  rewrite <- (Rabs_pos_eq ((b - a) * (b - a))), Rabs_mult by (apply Rle_0_sqr). pose proof (Rabs_pos (b - a)).
  apply Rmult_le_compat; auto.
Qed.
(** Computed numbers are no larger than `sizes`. *)
Fixpoint no_larger (m : list dyadic) (x : list R) : Prop :=
  match m, x with a :: m', b :: x' => Rabs b <= real a /\ no_larger m' x' | [], [] => True | _, _ => False end.
Lemma sizes_no_larger b r x y : within b x -> close r x y -> no_larger (sizes b r) y.
Proof.
  revert r x y. induction b as [|[l h] b IH]; intros [|e r] [|a x] [|c y]; simpl; try tauto. intros [H G] [F K].
  split; eauto. rewrite real_add. pose proof (largest_abs_above (l, h) a H).
  assert (Rabs c <= Rabs (c - a) + Rabs a) by (replace c with ((c - a) + a) at 1 by ring; apply Rabs_triang). lra.
Qed.
Lemma row_total row h : total (timesR row h) = dotR row h.
Proof. revert h. induction row as [|a row IH]; intros [|b h]; simpl; auto. now rewrite IH. Qed.
Lemma row_size row m h : no_larger m h -> total_abs (timesR (reals row) h) <= real (dot zero add mul (map abs row) m).
Proof.
  revert m h. induction row as [|a row IH]; intros [|c m] [|b h]; simpl; try tauto; try (rewrite real_zero; lra).
  intros [H G]. rewrite real_add, real_mul, real_abs, Rabs_mult. specialize (IH _ _ G).
  pose proof (Rmult_le_compat_l _ _ _ (Rabs_pos (real a)) H). unfold total_abs in *. lra.
Qed.
Lemma row_before row r x y : close r x y ->
  Rabs (dotR (reals row) y - dotR (reals row) x) <= real (dot zero add mul (map abs row) r).
Proof.
  revert r x y. induction row as [|w row IH]; intros [|e r] [|a x] [|b y]; simpl; try tauto;
    try (rewrite real_zero, Rminus_0_r, Rabs_R0; lra).
  intros [H G]. rewrite real_add, real_mul, real_abs. specialize (IH _ _ _ G).
  replace (real w * b + _ - _) with (real w * (b - a) + (dotR (reals row) y - dotR (reals row) x)) by ring.
  eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_mult.
  pose proof (Rmult_le_compat_l _ _ _ (Rabs_pos (real w)) H). lra.
Qed.
Lemma real_integer n : real (n, 0%Z) = IZR n. Proof. unfold real. simpl. ring. Qed.
Lemma length_times (row : list R) h : (length (timesR row h) <= length row)%nat.
Proof. revert h. induction row as [|a row IH]; intros [|b h]; simpl; try lia. specialize (IH h). lia. Qed.
Lemma size_length {A} (l : list A) : size l = Z.of_nat (length l).
Proof. induction l as [|a l IH]; auto. change (size (a :: l)) with (1 + size l)%Z. rewrite IH. cbn [length]. lia. Qed.
Lemma rounding_covers n m before e l v y : rounding_fits n m before e = true -> float_sum l v ->
  IZR (Z.of_nat (length l)) <= IZR n ->
  total_abs l <= real m -> Rabs (total l - y) <= real before -> Rabs (v - y) <= real e.
Proof.
  unfold rounding_fits. intros H F N M B. do 2 both H. apply Z.leb_le in H. apply at_most_real in H0, H1.
  rewrite !real_add, real_mul in *. unfold gammaD in *. rewrite real_add, real_mul in *.
  assert (forall k, real (n, k) = IZR n * powerRZ 2 k) as E by reflexivity. rewrite !E in *.
  assert (powerRZ 2 (-24) = roundoff) as U.
  { unfold roundoff. change (powerRZ 2 (-24)) with (/ 2 ^ 24). f_equal. simpl. lra. }
  rewrite U in *. assert (real (1, 126)%Z = powerRZ 2 126) as X by (unfold real; cbn [fst snd]; ring). rewrite X in *.
  pose proof (float_error l v (IZR n) (real m) F ltac:(rewrite INR_IZR_INZ;
    exact N) ltac:(apply (IZR_le _ 8388608); lia) M H1) as R.
  replace (v - y) with ((v - total l) + (total l - y)) by ring. eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.
Lemma layer_close w c m r e x h v : layer_fits w c m r e = true -> no_larger m h -> close r x h ->
  float_layer (realm w, reals c) h v -> close e (affine (realm w) (reals c) x) v.
Proof.
  intros H S C. unfold float_layer. simpl. revert c e v H. induction w as [|row w IH]; intros [|a c] [|z e] v; simpl;
    try discriminate.
  - intros _ F. inversion F. exact I.
  - intros H F. both H. inversion F as [|? y ? v' Fy Fv]; subst. simpl in Fy. split; [|now apply IH].
    eapply rounding_covers; [exact H|exact Fy| | |].
    + apply IZR_le. rewrite size_length. cbn [length]. pose proof (length_times (reals row) h) as L.
      rewrite map_length in L. lia.
    + simpl. rewrite real_add, real_abs. pose proof (row_size row m h S). lra.
    + simpl. rewrite row_total. replace (real a + _ - _) with (dotR (reals row) h - dotR (reals row) x) by ring.
      now apply row_before.
Qed.
Lemma roundings_close hid last b r bounds errors e x h v : check_roundings hid last b r bounds errors e = true ->
  within b x -> close r x h -> float_network (map real_layer hid) (real_layer last) h v ->
  close e (network (relu_layers hid) (real_layer last) x) v.
Proof.
  revert b r bounds errors x h. induction hid as [|[w c] hid IH]; intros b r [|v' bounds] [|s errors] x h; simpl;
    try discriminate.
  - intros H W C F. eapply layer_close; eauto. eapply sizes_no_larger; eauto.
  - intros H W C (y & Fy & F). do 2 both H. eapply (IH _ _ _ _ _ (map relu y)); eauto.
    + apply relu_within. eapply encloses_within; eauto.
    + apply close_relu. eapply layer_close; eauto. eapply sizes_no_larger; eauto.
Qed.
Lemma error_sound ps p b r e u bounds errors : check_error ps p b r e u bounds errors = true ->
  holds ps (Float_error p b r e u).
Proof.
  unfold check_error. intros H. do 3 both H. split; [now apply relu_part|]. intros x v Hx (h & C & F).
  apply real_nonnegative in H1. apply at_most_real in H0.
  assert (close e (value (part_at ps p) x) v) as K.
  { unfold value. rewrite relu_network by auto. eapply roundings_close; eauto. now apply within_clamped. }
  split; auto. apply sqrt_below; auto. rewrite real_square, real_mul in H0. pose proof (close_square _ _ _ K). lra.
Qed.
Lemma find_error_sound ps accepted p b r e u : Forall (holds ps) accepted ->
  find_error accepted p b r = Some (e, u) ->
  holds ps (Float_error p b r e u).
Proof.
  intros H. induction H as [|c rest Hc H IH]; [discriminate|]. destruct c; simpl find_error; auto.
  destruct (Nat.eqb_spec p p0); simpl; auto. destruct (same_box b b0) eqn:E; simpl; auto.
  destruct (same_numbers r r0) eqn:G; auto. apply same_box_eq in E. apply same_numbers_eq in G.
  intros K. inversion K. subst. exact Hc.
Qed.

(** Sums: coordinate by coordinate. *)
Lemma close_nth r x y i : close r x y -> (i < length r)%nat -> Rabs (nth i y 0 - nth i x 0) <= real (nth i r zero).
Proof.
  revert r x y. induction i as [|i IH]; intros [|e r] [|a x] [|b y]; simpl; try tauto; try lia; intros [H G] L; auto.
  apply IH; auto. lia.
Qed.
Lemma nth_close r x y : length x = length r -> length y = length r ->
  (forall i, (i < length r)%nat -> Rabs (nth i y 0 - nth i x 0) <= real (nth i r zero)) -> close r x y.
Proof.
  revert x y. induction r as [|e r IH]; intros [|a x] [|b y]; simpl; try discriminate; auto. intros Hx Hy H. split.
  - apply (H O). lia.
  - apply IH; try lia. intros i Hi. apply (H (S i)). lia.
Qed.
Lemma no_larger_nth m x i : no_larger m x -> (i < length m)%nat -> Rabs (nth i x 0) <= real (nth i m zero).
Proof.
  revert m x. induction i as [|i IH]; intros [|a m] [|b x]; simpl; try tauto; try lia; intros [H G] L; auto.
  apply IH; auto. lia.
Qed.
Lemma nth_plusR i u v : nth i (plusR u v) 0 = nth i u 0 + nth i v 0.
Proof. revert i v. induction u as [|a u IH]; intros [|i] [|b v]; simpl; try ring; auto. Qed.
Lemma nth_plusD i u v : real (nth i (plus add u v) zero) = real (nth i u zero) + real (nth i v zero).
Proof.
  revert i v. induction u as [|a u IH]; intros [|i] [|b v]; simpl; rewrite ?real_zero; try ring; auto using real_add.
Qed.
Lemma nth_scaleD i k u : (i < length u)%nat -> real (nth i (scale mul k u) zero) = real k * real (nth i u zero).
Proof. revert i. induction u as [|a u IH]; intros [|i] L; simpl in *; try lia; [apply real_mul|]. apply IH. lia. Qed.
Lemma nth_zeros i n : nth i (zeros n) 0 = 0.
Proof. unfold zeros. revert i. induction n; intros [|i]; simpl; auto. Qed.
Lemma total_nth i us : total (map (fun u => nth i u 0) us) = nth i (vector_sum us) 0.
Proof. induction us as [|u us IH]; simpl; [now destruct i|]. now rewrite IH, nth_plusR. Qed.
Lemma sizes_length b r : length (sizes b r) = min (length b) (length r).
Proof. revert r. induction b as [|[l h] b IH]; intros [|a r]; simpl; auto. Qed.
Lemma all_nth_nonneg e i : forallb is_nonnegative e = true -> 0 <= real (nth i e zero).
Proof.
  revert i. induction e as [|a e IH]; intros [|i]; simpl; rewrite ?real_zero; try lra; intros H; both H; auto.
  now apply real_nonnegative.
Qed.

Definition computed_fit ps (t_xs : term * list dyadic * list (list R)) vs :=
  Forall2 (evaluates (part_at ps (phi (fst (fst t_xs)))) (snd (fst t_xs))) (snd t_xs) vs.
Lemma group_errors ps p (b v : box) r e u n xs vs i : holds ps (Within p b v) -> holds ps (Float_error p b r e u) ->
  length v = n -> length e = n -> (i < n)%nat -> Forall (within b) xs -> Forall2 (evaluates (part_at ps p) r) xs vs ->
  length vs = length xs /\
  total_abs (map (fun u => nth i u 0) vs) <= INR (length xs) * real (nth i (sizes v e) zero) /\
  Rabs (total (map (fun u => nth i u 0) vs) - total (map (fun u => nth i u 0) (map (value (part_at ps p)) xs)))
    <= INR (length xs) * real (nth i e zero).
Proof.
  intros HW HE Lv Le Hi HF H. induction H as [|x y xs vs Hxy H IH].
  - simpl. rewrite Rminus_0_r, Rabs_R0. split; auto. lra.
  - inversion HF as [|? ? Hx HF']; subst. destruct (IH HF') as (L & M & E). destruct (proj2 HE x y Hx Hxy) as [C _].
    assert (i < length (sizes v e))%nat as Is by (rewrite sizes_length; lia).
    pose proof (no_larger_nth _ _ i (sizes_no_larger _ _ _ _ (HW x Hx) C) Is) as S.
    pose proof (close_nth _ _ _ i C ltac:(lia)) as D.
    cbn [length map total total_abs fold_right]. fold (total (map (fun u => nth i u 0) vs)).
    fold (total_abs (map (fun u => nth i u 0) vs)). rewrite S_INR. split; [lia|]. split; [lra|].
    change (fold_right Rplus 0 ?l) with (total l).
    replace (nth i y 0 + _ - _) with ((nth i y 0 - nth i (value (part_at ps p) x) 0) +
      (total (map (fun u => nth i u 0) vs) - total (map (fun u => nth i u 0) (map (value (part_at ps p)) xs))))
        by ring.
    eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.
Lemma sum_errors_sound ps accepted n terms count m s inputs computed i : Forall (holds ps) accepted ->
  sum_errors accepted n terms = Some (count, m, s) -> Forall2 may_stand (map fst terms) inputs ->
  Forall2 (computed_fit ps) (combine terms inputs) computed -> (i < n)%nat ->
  IZR (Z.of_nat (S (length (concat computed)))) <= IZR count /\
  total_abs (map (fun u => nth i u 0) (concat computed)) <= real (nth i m zero) /\
  Rabs (total (map (fun u => nth i u 0) (concat computed)) - total (map (fun u => nth i u 0)
    (flat_map (fun g => map (value (part_at ps (phi (fst g)))) (snd g)) (combine (map fst terms) inputs)))) <= real
      (nth i s zero).
Proof.
  intros HA. revert count m s inputs computed. induction terms as [|[[p b low high] r] terms IH];
    intros count m s inputs computed.
  - simpl. intros H M F Hi. inversion H. inversion M. subst. inversion F. simpl.
    rewrite Rminus_0_r, Rabs_R0, !nth_repeat, !real_zero. repeat split; try lra. apply IZR_le. lia.
  - simpl sum_errors. destruct (find_within accepted p b) as [v|] eqn:Ev; [|discriminate].
    destruct (find_error accepted p b r) as [[e u]|] eqn:Ee; [|discriminate].
    destruct (sum_errors accepted n terms) as [[[count' m'] s']|] eqn:Es; [|discriminate].
    destruct (_ && _)%bool eqn:C; [|discriminate]. intros H M F Hi. inversion H. subst count m s. clear H.
    inversion M as [|? xs ? inputs' [K B] M']; subst. simpl combine in F. inversion F as [|? vs ? computed' G F'];
      subst.
    do 3 both C. apply Nat.eqb_eq in C, H1. apply Z.leb_le in H0.
    destruct (IH _ _ _ _ _ eq_refl M' F' Hi) as (N & S & D). unfold computed_fit in G. simpl in G, K, B.
    destruct (group_errors ps p b v r e u n xs vs i (find_within_sound _ _ _ _ _ HA Ev) (find_error_sound _ _ _ _ _
      _ _ HA Ee)
      C H1 Hi B G) as (L1 & S1 & D1).
    assert (INR (length xs) <= IZR high) as Hn by (rewrite INR_IZR_INZ; apply IZR_le; lia).
    assert (i < length (sizes v e))%nat as Is by (rewrite sizes_length; lia).
    pose proof (all_nth_nonneg e i H) as Pe.
    assert (0 <= real (nth i (sizes v e) zero)) as Pm.
    { destruct xs as [|x xs].
      - clear - Is H Pe. revert v e i Is H Pe. induction v as [|j v IHv]; intros [|a e] [|i]; simpl; try lia;
        intros Is H Pe.
        + rewrite real_add. both H. apply real_nonnegative in H. unfold largest_abs. rewrite real_larger, !real_abs.
          pose proof (Rabs_pos (real (fst j))). pose proof (Rmax_l (Rabs (real (fst j))) (Rabs (real (snd j)))). lra.
        + both H. apply IHv; auto. lia.
      - assert (within b x) as Hx by (inversion B; auto). inversion G as [|? y ? ? Hy _]; subst.
        destruct (proj2 (find_error_sound _ _ _ _ _ _ _ HA Ee) x y Hx Hy) as [Cl _].
        pose proof (no_larger_nth _ _ i (sizes_no_larger _ _ _ _ (find_within_sound _ _ _ _ _ HA Ev x Hx) Cl) Is)
          as Q.
        pose proof (Rabs_pos (nth i y 0)). lra. }
    cbn [concat map combine flat_map fst snd phi]. rewrite !map_app, total_app, total_app, total_abs_app, app_length.
    rewrite !nth_plusD, !nth_scaleD, !real_integer by lia. split; [|split].
    + apply le_IZR in N. apply IZR_le. lia.
    + pose proof (Rmult_le_compat_r _ _ _ Pm Hn). lra.
    + pose proof (Rmult_le_compat_r _ _ _ Pe Hn).
      match goal with |- Rabs (?a + ?b - (?c + ?d)) <= _ => replace (a + b - (c + d)) with ((a - c) + (b - d))
        by ring end.
      eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.
Lemma terms_relu ps accepted n terms sums : Forall (holds ps) accepted -> sum_errors accepted n terms = Some sums ->
  Forall (fun t => all_relu (part_at ps (phi (fst t)))) terms.
Proof.
  intros HA. revert sums. induction terms as [|[[p b low high] r] terms IH]; intros sums; [constructor|]. simpl.
  destruct (find_within accepted p b); [|discriminate].
  destruct (find_error accepted p b r) as [[e u]|] eqn:Ee; [|discriminate].
  destruct (sum_errors accepted n terms); [|discriminate]. intros _. constructor; [|now eapply IH].
  apply (find_error_sound _ _ _ _ _ _ _ HA Ee).
Qed.
Lemma sum_fits_nth count m e errors i : sum_fits count m e errors = true -> (i < length errors)%nat ->
  rounding_fits count (nth i m zero) (nth i e zero) (nth i errors zero) = true.
Proof.
  revert m e errors. induction i as [|i IH]; intros [|a m] [|b e] [|x errors]; simpl; try discriminate; try lia;
    intros H L;
    both H; auto. apply IH; auto. lia.
Qed.
Lemma sum_error_sound ps accepted terms rho u sums errors : Forall (holds ps) accepted ->
  check_sum_error ps accepted terms rho u sums errors = true -> holds ps (Sum_float_error terms rho u).
Proof.
  intros HA. unfold check_sum_error. set (n := inputs_of (part_at ps rho)).
  destruct (sum_ends _ _ _) as [s|] eqn:Es; [|discriminate].
  destruct (sum_errors _ _ _) as [[[count m] e]|] eqn:Ee; [|discriminate].
  destruct (find_error _ _ _ _) as [[e' w]|] eqn:Ew; [|discriminate].
  intros H. split; [apply (find_error_sound _ _ _ _ _ _ _ HA Ew)|]. split; [eapply terms_relu; eauto|].
  intros inputs computed z v M F [Lz S] N. do 4 both H. rename H0 into Hw, H1 into Hf, H2 into Hl, H3 into Hc.
  apply Nat.eqb_eq in Hl. apply at_most_real in Hw.
  pose proof (sum_ends_sound _ _ _ _ _ _ HA Es M) as W. apply (contains_within _ _ _ H) in W.
  set (exact := sum_of_terms ps rho (combine (map fst terms) inputs)) in *.
  assert (evaluates (part_at ps rho) errors exact v) as EV;
    [|destruct (proj2 (find_error_sound _ _ _ _ _ _ _ HA Ew) exact v W EV) as [_ B]; lra].
  exists z. split; auto. destruct (clamp (part_at ps rho)) eqn:E; [|discriminate]. simpl clamped.
  assert (length exact = n) as Lx.
  { pose proof (within_length _ _ (sum_ends_sound _ _ _ _ _ _ HA Es M)) as X. fold exact in X. rewrite X.
    eapply length_sum_ends; eauto. }
  apply nth_close; [now rewrite Hl|now rewrite Hl|]. intros i Hi. rewrite Hl in Hi.
  destruct (sum_errors_sound _ _ _ _ _ _ _ _ _ i HA Ee M F Hi) as (C1 & C2 & C3).
  eapply rounding_covers; [apply sum_fits_nth; [exact Hf|lia]|apply S; exact Hi| | |].
  - simpl length. rewrite map_length. exact C1.
  - simpl. rewrite Rabs_R0. lra.
  - simpl total. rewrite Rplus_0_l. unfold exact, sum_of_terms. fold n. simpl vector_sum.
    rewrite nth_plusR, nth_zeros, Rplus_0_l, <- total_nth. exact C3.
Qed.
